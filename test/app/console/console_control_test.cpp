// SPDX-License-Identifier: BSD-3-Clause
// Requests of pages, and the commands that they cause on the bus.
#include <berth/operator_control_t.hpp>

#include "app/console/control/command_handler.h"
#include "app/console/control/page_command.h"
#include "common/core/error.h"
#include "test/procedures/engine/engine_bench.h"

using namespace berth;
using namespace berth::console;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

namespace {

const nlohmann::json none = nlohmann::json::object();

const std::string long_move =
    "name: test\n"
    "steps:\n"
    "  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}\n"
    "    timeout: 60 s\n"
    "  - wait: 2 s\n";

/// Viewers at a console next to the fake cell, with or without a procedure in it.
class Pages {
 public:
  explicit Pages(Bus& the_bus, Loop& the_loop)
      : bus(the_bus),
        loop(the_loop),
        handler(bus, loop, {"me@console", true, fake::session},
                {[this](const std::string& viewer, const Answer& answer) {
                   answers[viewer].push_back(answer);
                 },
                 [this](std::int8_t severity, const std::string& code, const std::string& text) {
                   events.push_back({severity, code, text});
                 },
                 [this](const RunOrder& order) {
                   orders.push_back(order);
                   return run_refusal;
                 }}) {
    bus.subscribe<procedure_command_t>(
        channels::procedure_command, Queue::fifo(),
        [this](const procedure_command_t& c) { commands.push_back(c); });
    bus.subscribe<testbed_command2_t>(
        channels::testbed_command, Queue::fifo(),
        [this](const testbed_command2_t& c) { orders_sent.push_back(c); });
    loop.every(50 * millisecond, [this] { handler.tick(); });
    loop.every(500 * millisecond, [this] {
      if (!page_alive.empty() && handler.control().viewer == page_alive) {
        handler.take({page_alive, 0, "keep_control", none, ""});
      }
    });
  }

  void request(const std::string& viewer, const std::string& name,
               const nlohmann::json& arguments = none, const std::string& confirm = "") {
    handler.take({viewer, ++id, name, arguments, confirm});
  }
  /// The answer to the last request; id 0 while there is none.
  Answer last(const std::string& viewer) {
    for (const Answer& answer : answers[viewer]) {
      if (answer.id == id) return answer;
    }
    return {};
  }
  bool has_event(const std::string& code, const std::string& text) const {
    for (const PublishedEvent& event : events) {
      if (event.code == code && event.text.find(text) != std::string::npos) return true;
    }
    return false;
  }

  struct PublishedEvent {
    std::int8_t severity;
    std::string code;
    std::string text;
  };
  Bus& bus;
  Loop& loop;
  std::map<std::string, std::vector<Answer>> answers;
  std::vector<PublishedEvent> events;
  std::vector<RunOrder> orders;
  std::vector<procedure_command_t> commands;
  std::vector<testbed_command2_t> orders_sent;
  std::string run_refusal;
  std::string page_alive;  ///< the viewer whose page keeps control, when it has it
  std::int64_t id = 0;
  CommandHandler handler;
};

struct WithProcedure {
  WithProcedure() {
    bench.run_to(procedure_state_t::RUNNING);
    bench.run_for(1);
  }
  /// Sends the request and waits for the answer.
  Answer request(const std::string& viewer, const std::string& name,
                 const nlohmann::json& arguments = none, const std::string& confirm = "") {
    pages.request(viewer, name, arguments, confirm);
    bench.run_for(0.6);
    return pages.last(viewer);
  }
  /// Sends the request and then its confirmation, as a person who answers yes.
  Answer request_and_confirm(const std::string& viewer, const std::string& name,
                             const nlohmann::json& arguments = none) {
    const Answer first = request(viewer, name, arguments);
    REQUIRE_FALSE(first.accepted);
    REQUIRE_FALSE(first.confirm.empty());
    return request(viewer, name, arguments, first.confirm);
  }
  void take(const std::string& viewer) {
    pages.page_alive = viewer;
    REQUIRE(request(viewer, "take_control").accepted);
    REQUIRE(pages.handler.control().viewer == viewer);
  }
  std::int8_t state() const { return bench.node->state().state; }

  static fake::Script slow() {
    fake::Script script;
    script.move_takes_s = 40;
    return script;
  }
  fake::EngineBench bench{slow(), long_move};
  Pages pages{*bench.operator_bus, bench.simulation.make_loop()};
};

/// The nodes of a cell, without a procedure.
struct CellAlone {
  CellAlone() { simulation.run_for(2 * second); }
  Answer request(const std::string& viewer, const std::string& name,
                 const nlohmann::json& arguments = none, const std::string& confirm = "") {
    pages.request(viewer, name, arguments, confirm);
    simulation.run_for(600 * millisecond);
    return pages.last(viewer);
  }
  fake::Script script;
  Simulation simulation;
  fake::Testbed testbed{script, simulation.make_bus(), simulation.make_loop()};
  fake::Facility facility{script, simulation.make_bus(), simulation.make_loop()};
  Pages pages{simulation.make_bus(), simulation.make_loop()};
};

}  // namespace

TEST_CASE("only the viewer that has control is obeyed; a hold is obeyed from every viewer") {
  WithProcedure w;
  for (const char* name : {"resume", "step", "retry", "reset", "abort", "speed", "lamps",
                           "release_control", "keep_control", "run", "answer", "skip"}) {
    INFO(name);
    const Answer answer = w.request("viewer-1", name);
    CHECK_FALSE(answer.accepted);
    CHECK(answer.text == "take control first");
  }
  CHECK(w.pages.commands.empty());
  w.take("viewer-1");
  CHECK(w.pages.handler.control().holder == "me@console viewer-1");
  CHECK(w.pages.handler.control().holds_when_lost);
  CHECK(w.request("viewer-2", "abort").text == "me@console viewer-1 has control");
  CHECK(w.state() == procedure_state_t::RUNNING);
  CHECK(w.pages.has_event("operator-asked", "me@console viewer-2: abort"));
  CHECK(w.pages.has_event("operator-refused", "me@console viewer-2: no abort"));
  CHECK(w.request("viewer-2", "hold").accepted);
  CHECK(w.state() == procedure_state_t::HELD);
  CHECK_FALSE(w.request("viewer-1", "fly").accepted);
}

TEST_CASE("commands that move arms need confirmation, by a token that is valid once and briefly") {
  WithProcedure w;
  w.take("viewer-1");
  REQUIRE(w.request("viewer-1", "hold").accepted);
  w.bench.run_for(3);
  const Answer first = w.request("viewer-1", "resume");
  CHECK_FALSE(first.accepted);
  REQUIRE_FALSE(first.confirm.empty());
  CHECK_THAT(first.text, Contains("step 1 of 4, 'move'") && Contains("the arms may move"));
  CHECK(w.state() == procedure_state_t::HELD);
  SECTION("confirmed, it goes on, once") {
    CHECK(w.request("viewer-1", "resume", none, first.confirm).accepted);
    CHECK(w.state() == procedure_state_t::RUNNING);
    REQUIRE(w.request("viewer-1", "hold").accepted);
    w.bench.run_for(3);
    const Answer again = w.request("viewer-1", "resume", none, first.confirm);
    CHECK_FALSE(again.accepted);
    CHECK(again.confirm != first.confirm);
    CHECK(w.state() == procedure_state_t::HELD);
  }
  SECTION("too late") {
    w.bench.run_for(10);
    CHECK_FALSE(w.request("viewer-1", "resume", none, first.confirm).accepted);
    CHECK(w.state() == procedure_state_t::HELD);
  }
  SECTION("for something else") {
    CHECK_FALSE(w.request("viewer-1", "retry", none, first.confirm).accepted);
    CHECK_FALSE(w.request("viewer-1", "resume", none, first.confirm).accepted);  // used up
    CHECK(w.state() == procedure_state_t::HELD);
  }
  SECTION("by another viewer") {
    w.pages.page_alive = "viewer-2";
    REQUIRE(w.request_and_confirm("viewer-2", "take_control").accepted);
    CHECK_FALSE(w.request("viewer-2", "resume", none, first.confirm).accepted);
    CHECK(w.state() == procedure_state_t::HELD);
  }
  SECTION("guessed") {
    CHECK_FALSE(w.request("viewer-1", "resume", none, "yes").accepted);
    CHECK(w.state() == procedure_state_t::HELD);
  }
}

TEST_CASE("each command reaches the engine") {
  WithProcedure w;
  w.take("viewer-1");
  SECTION("speed: slower at once, faster after confirmation") {
    CHECK(w.request("viewer-1", "speed", {{"override", 0.4}}).accepted);
    CHECK(w.bench.testbed->speed_override == Approx(0.4));
    w.bench.run_for(0.5);
    // the fake testbed's state is what the handler goes by
    CHECK_FALSE(w.request("viewer-1", "speed", {{"override", 7}}).accepted);
    CHECK_FALSE(w.request("viewer-1", "speed", {{"override", "fast"}}).accepted);
    CHECK_FALSE(w.request("viewer-1", "speed").accepted);
    const Answer faster = w.request_and_confirm("viewer-1", "speed", {{"override", 0.9}});
    CHECK(faster.accepted);
    CHECK(w.bench.testbed->speed_override == Approx(0.9));
  }
  SECTION("lamps") {
    CHECK(w.request("viewer-1", "lamps", {{"sun", 0.8}, {"azimuth", 0.5}}).accepted);
    w.bench.run_for(1);
    CHECK(w.bench.facility->last.sun_lamp == Approx(0.8));
    CHECK(w.bench.facility->last.sun_azimuth_rad == Approx(0.5).margin(1e-3));
    const Answer wrong = w.request("viewer-1", "lamps", {{"sun", 3}});
    CHECK_FALSE(wrong.accepted);
    CHECK_THAT(wrong.text, Contains("sun"));
    CHECK_FALSE(w.request("viewer-1", "lamps").accepted);
  }
  SECTION("skip and its reason; the engine's refusal is the answer") {
    const Answer none = w.request_and_confirm("viewer-1", "skip");
    CHECK_FALSE(none.accepted);
    CHECK_THAT(none.text, Contains("a reason is needed"));
    CHECK(w.request_and_confirm("viewer-1", "skip", {{"reason", "seen by eye"}}).accepted);
    CHECK(w.bench.step("move").detail.find("seen by eye") == 0);
  }
  SECTION("retry") {
    CHECK(w.request_and_confirm("viewer-1", "retry").accepted);
    CHECK(w.bench.step("move").attempts == 2);
  }
  SECTION("step, while it runs, makes nothing move") {
    CHECK(w.request("viewer-1", "step").accepted);
  }
  SECTION("abort") {
    CHECK(w.request("viewer-1", "abort", {{"reason", "enough"}}).accepted);
    CHECK(w.bench.run() == procedure_state_t::ABORTED);
    CHECK(w.bench.node->state().reason == "enough");
  }
  SECTION("answer, without a prompt") {
    const Answer answer = w.request("viewer-1", "answer", {{"prompt_id", "1.1"}, {"text", "yes"}});
    CHECK_FALSE(answer.accepted);
    CHECK_THAT(answer.text, Contains("no prompt is open"));
  }
  SECTION("run, while one runs") {
    CHECK_FALSE(
        w.request_and_confirm("viewer-1", "run", {{"procedure", "approach.yaml"}}).accepted);
    CHECK(w.pages.orders.empty());
  }
  SECTION("given back") {
    CHECK(w.request("viewer-1", "release_control").accepted);
    CHECK(w.pages.handler.control().holder.empty());
    w.bench.run_for(3);
    CHECK(w.state() == procedure_state_t::RUNNING);
    CHECK(w.pages.handler.control().holder.empty());
  }
}

TEST_CASE("control is taken from another viewer or terminal only after confirmation") {
  WithProcedure w;
  SECTION("a viewer") {
    w.take("viewer-1");
    const Answer first = w.request("viewer-2", "take_control");
    CHECK_THAT(first.text, Contains("me@console viewer-1 has control and would lose it"));
    CHECK(w.pages.handler.control().viewer == "viewer-1");
    w.pages.page_alive = "viewer-2";
    CHECK(w.request("viewer-2", "take_control", none, first.confirm).accepted);
    CHECK(w.pages.handler.control().viewer == "viewer-2");
    CHECK_FALSE(w.request("viewer-1", "abort").accepted);
    CHECK_FALSE(w.request("viewer-1", "keep_control").accepted);
    w.bench.run_for(5);
    CHECK(w.pages.handler.control().viewer == "viewer-2");
    CHECK(w.state() == procedure_state_t::RUNNING);
  }
  SECTION("a terminal") {
    w.bench.command(procedure_command_t::TAKE_CONTROL);
    w.bench.run_for(0.2);
    CHECK(w.pages.handler.control().holder == "operator");
    CHECK(w.pages.handler.control().viewer.empty());
    CHECK(w.request("viewer-1", "abort").text == "operator has control");
    w.pages.page_alive = "viewer-1";
    CHECK(w.request_and_confirm("viewer-1", "take_control").accepted);
    CHECK(w.pages.handler.control().viewer == "viewer-1");
  }
}

TEST_CASE("a page that falls silent loses control, and the procedure is held") {
  WithProcedure w;
  w.take("viewer-1");
  // whichever of engine and console is the first to see it
  w.bench.run_for(4 + 0.013 * GENERATE(0, 1, 2, 3, 4, 5, 6));
  CHECK(w.state() == procedure_state_t::RUNNING);
  w.pages.page_alive.clear();
  w.bench.run_for(2.5);
  CHECK(w.pages.handler.control().holder.empty());
  w.bench.run_for(5);
  CHECK(w.pages.handler.control().holder.empty());
  CHECK(w.state() == procedure_state_t::HELD);
  CHECK(w.bench.node->state().reason == "control of me@console viewer-1 lapsed");
}

TEST_CASE("where no procedure runs, control is the testbed's lease") {
  CellAlone w;
  CHECK(w.request("viewer-1", "lamps", {{"sun", 0.5}}).text == "take control first");
  w.pages.page_alive = "viewer-1";
  REQUIRE(w.request("viewer-1", "take_control").accepted);
  CHECK(w.pages.handler.control().viewer == "viewer-1");
  CHECK(w.pages.has_event("control-taken", "me@console viewer-1 has control"));
  CHECK(w.request("viewer-1", "lamps", {{"sun", 0.5}}).accepted);
  CHECK(w.facility.last.sun_lamp == Approx(0.5));
  CHECK(w.facility.last.commander == "me@console viewer-1");
  CHECK(w.request("viewer-1", "speed", {{"override", 0.3}}).accepted);
  CHECK(w.testbed.speed_override == Approx(0.3));
  CHECK(w.request("viewer-1", "resume").text == "no procedure runs");
  CHECK(w.request("viewer-2", "hold").accepted);
  CHECK(w.testbed.obeyed.back().command == testbed_command2_t::HOLD);
  CHECK(w.testbed.obeyed.back().commander == "me@console viewer-2");
  w.simulation.run_for(3 * second);
  CHECK(w.pages.handler.control().viewer == "viewer-1");
  SECTION("given back") {
    CHECK(w.request("viewer-1", "release_control").accepted);
    CHECK(w.testbed.obeyed.back().command == testbed_command2_t::RELEASE_LEASE);
    CHECK(w.pages.handler.control().holder.empty());
  }
  SECTION("lost") {
    w.pages.page_alive.clear();
    w.simulation.run_for(2 * second);
    CHECK(w.testbed.obeyed.back().command == testbed_command2_t::RELEASE_LEASE);
    CHECK(w.pages.has_event("control-lapsed", "control of me@console viewer-1 lapsed"));
    CHECK(w.pages.handler.control().holder.empty());
  }
  SECTION("a procedure is run, after confirmation, as requested") {
    const nlohmann::json arguments = {{"procedure", "approach.yaml"},
                                      {"seed", 1},
                                      {"parameters", {{"speed", "10 mm/s"}, {"n", 3}}}};
    const Answer first = w.request("viewer-1", "run", arguments);
    CHECK_THAT(first.text, Contains("approach.yaml begins"));
    CHECK(w.pages.orders.empty());
    CHECK(w.request("viewer-1", "run", arguments, first.confirm).accepted);
    REQUIRE(w.pages.orders.size() == 1);
    CHECK(w.pages.orders[0].procedure == "approach.yaml");
    CHECK(w.pages.orders[0].parameters ==
          std::map<std::string, std::string>{{"speed", "10 mm/s"}, {"n", "3"}});
    CHECK(w.pages.orders[0].operator_name == "me@console viewer-1");
    w.pages.run_refusal = "no such procedure";
    const Answer second = w.request("viewer-1", "run", arguments);
    CHECK(w.request("viewer-1", "run", arguments, second.confirm).text == "no such procedure");
  }
}

TEST_CASE("a hold is repeated until it is acknowledged, however many messages are lost") {
  SECTION("by the testbed") {
    CellAlone w;
    w.script.commands_lost = 6;
    CHECK(w.request("viewer-1", "hold").id == 0);
    w.simulation.run_for(500 * millisecond);
    CHECK(w.pages.last("viewer-1").accepted);
    REQUIRE(w.testbed.obeyed.size() == 1);
    CHECK(w.testbed.obeyed[0].command == testbed_command2_t::HOLD);
    const std::size_t sent = w.pages.orders_sent.size();
    w.simulation.run_for(second);
    CHECK(w.pages.orders_sent.size() == sent);
  }
  SECTION("by the procedure") {
    WithProcedure w;
    w.bench.simulation.set_bus_loss(1);
    w.pages.request("viewer-1", "hold", none, "");
    w.bench.run_for(0.6);
    w.bench.simulation.set_bus_loss(0);
    w.bench.run_for(0.3);
    CHECK(w.state() == procedure_state_t::HELD);
    const std::size_t sent = w.pages.commands.size();
    w.bench.run_for(1);
    CHECK(w.pages.commands.size() == sent);
  }
  SECTION("by the testbed, where the procedure does not answer") {
    WithProcedure w;
    w.bench.simulation.set_bus_loss(1);
    w.pages.request("viewer-1", "hold", none, "");
    w.bench.run_for(2.1);
    w.bench.simulation.set_bus_loss(0);
    w.bench.run_for(0.3);
    CHECK(w.bench.testbed_received(testbed_command2_t::HOLD));
    CHECK_THAT(w.pages.last("viewer-1").text,
               Contains("the procedure does not answer; the testbed holds"));
  }
}

TEST_CASE("two viewers at once each get the answer to their own request") {
  WithProcedure w;
  w.take("viewer-1");
  w.bench.simulation.set_bus_loss(0.5);
  w.pages.request("viewer-1", "answer", {{"prompt_id", "1.1"}, {"text", "yes"}});
  const std::int64_t answer = w.pages.id;
  w.pages.request("viewer-2", "hold");
  const std::int64_t hold = w.pages.id;
  w.bench.run_for(1.8);
  w.bench.simulation.set_bus_loss(0);
  const auto to = [&](const std::string& viewer, std::int64_t id) {
    w.pages.id = id;
    return w.pages.last(viewer);
  };
  CHECK_FALSE(to("viewer-1", answer).accepted);
  CHECK_THAT(to("viewer-1", answer).text, Contains("no prompt is open"));
  CHECK(to("viewer-2", hold).accepted);
}

TEST_CASE("lamps and speed of a cell without a procedure are accepted when the cell accepts them") {
  CellAlone w;
  w.pages.page_alive = "viewer-1";
  REQUIRE(w.request("viewer-1", "take_control").accepted);
  SECTION("refused by the facility") {
    w.script.refuse_lamps = "the lamp is being changed";
    const Answer answer = w.request("viewer-1", "lamps", {{"sun", 0.5}});
    CHECK_FALSE(answer.accepted);
    CHECK(answer.text == "the lamp is being changed");
  }
  SECTION("no answer") {
    w.simulation.set_bus_loss(1);
    w.pages.request("viewer-1", "lamps", {{"sun", 0.5}});
    const std::int64_t lamps = w.pages.id;
    w.pages.request("viewer-1", "speed", {{"override", 0.3}});
    w.simulation.run_for(1900 * millisecond);
    CHECK(w.pages.last("viewer-1").id == 0);
    w.simulation.run_for(200 * millisecond);
    CHECK_FALSE(w.pages.last("viewer-1").accepted);
    CHECK(w.pages.last("viewer-1").text == "the testbed does not answer");
    w.pages.id = lamps;
    CHECK(w.pages.last("viewer-1").text == "the facility does not answer");
  }
}

TEST_CASE("a commander of the testbed from elsewhere keeps it") {
  CellAlone w;
  testbed_command2_t take{};
  take.command = testbed_command2_t::TAKE_LEASE;
  take.session = fake::session;
  take.commander = "gnc";
  take.utime_expires = w.simulation.now() + second;
  w.pages.bus.publish(channels::testbed_command, take);
  w.simulation.run_for(200 * millisecond);
  CHECK(w.pages.handler.control().holder == "gnc");
  const Answer answer = w.request("viewer-1", "take_control");
  CHECK_FALSE(answer.accepted);
  CHECK(answer.confirm.empty());
  CHECK(answer.text == "gnc commands the testbed");
}

TEST_CASE("control of the cell becomes control of the procedure that begins in it, and again") {
  fake::Script script;
  script.ready_after_s = 3;
  script.move_takes_s = 4;
  fake::EngineBench bench(script, long_move);
  Pages pages(*bench.operator_bus, bench.simulation.make_loop());
  // the console is there first; the engine is silent until it has received its nodes' messages
  bench.run_for(0.3);
  pages.page_alive = "viewer-1";
  pages.request("viewer-1", "take_control");
  bench.run_for(1);
  CHECK(pages.handler.control().viewer == "viewer-1");
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(pages.handler.control().viewer == "viewer-1");
  bench.run_for(2);
  CHECK(pages.handler.control().viewer == "viewer-1");
  CHECK(pages.orders_sent.back().commander == "me@console viewer-1");
}

TEST_CASE("arguments of the wrong kind are refused by name") {
  const auto command = [](const nlohmann::json& arguments) {
    return Command{"viewer-1", 1, "run", arguments, ""};
  };
  CHECK_THROWS_WITH(text_in(command({{"procedure", 3}}), "procedure"),
                    "run: procedure: found 3, expected a text");
  CHECK_THROWS_WITH(number_in(command({}), "x"), Contains("expected a number"));
  CHECK_THROWS_WITH(parameters_in(command({{"parameters", {1, 2}}})),
                    Contains("expected names and values"));
  CHECK_THROWS_WITH(parameters_in(command({{"parameters", {{"a", nlohmann::json::array()}}}})),
                    StartsWith("run: parameters.a: found []"));
}
