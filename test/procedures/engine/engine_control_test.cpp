// SPDX-License-Identifier: BSD-3-Clause
// Who of several operators steers, how fast, and in what light.
#include <berth/operator_control_t.hpp>

#include "procedures/engine/operator_control.h"
#include "test/procedures/engine/engine_bench.h"

using namespace berth;
using fake::EngineBench;
using Command = procedure_command_t;

namespace {

const std::string long_move =
    "name: test\n"
    "steps:\n"
    "  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}\n"
    "    timeout: 20 s\n"
    "  - wait: 1 s\n";

/// Two operators at a procedure that moves for ten seconds.
class Operators {
 public:
  Operators() : bench(slow(), long_move) {
    bench.operator_bus->subscribe<operator_control_t>(
        channels::operator_control, Queue::fifo(),
        [this](const operator_control_t& message) { control = message; });
    bench.run_to(procedure_state_t::RUNNING);
  }

  void send(const std::string& commander, std::int8_t what, const std::string& text = "") {
    Command message{};
    message.utime = bench.simulation.now();
    message.seq = ++seq_;
    message.session = fake::session;
    message.utime_expires = message.utime + second;
    message.commander = commander;
    message.command = what;
    message.text = text;
    bench.operator_bus->publish(channels::procedure_command, message);
    bench.run_for(0.1);
  }

  /// Keeps control for some seconds.
  void keep(const std::string& commander, int s) {
    for (int i = 0; i < 2 * s; ++i) {
      send(commander, Command::KEEP_CONTROL);
      bench.run_for(0.4);
    }
  }

  bool refused(const std::string& text) const {
    for (const event_t& event : bench.events) {
      if (event.code == "command-refused" && event.text.find(text) != std::string::npos) {
        return true;
      }
    }
    return false;
  }
  std::int8_t state() const { return bench.node->state().state; }

  EngineBench bench;
  operator_control_t control{};

 private:
  static fake::Script slow() {
    fake::Script script;
    script.move_takes_s = 10;
    return script;
  }
  std::int64_t seq_ = 0;
};

}  // namespace

TEST_CASE("without a holder of control all are obeyed, then only the holder") {
  Operators two;
  two.send("bob", Command::HOLD);
  CHECK(two.state() == procedure_state_t::HELD);
  two.bench.run_for(3);  // to rest
  two.send("alice", Command::RESUME);
  CHECK(two.state() == procedure_state_t::RUNNING);
  CHECK(two.control.holder.empty());

  two.send("alice", Command::TAKE_CONTROL);
  CHECK(two.control.holder == "alice");
  CHECK(two.control.utime_expires > two.bench.simulation.now());
  CHECK(two.bench.event_text("control-taken") == "alice has control");
  two.send("alice", Command::HOLD);
  two.send("bob", Command::RESUME);
  CHECK(two.state() == procedure_state_t::HELD);
  CHECK(two.refused("no resume: alice has control"));
  for (const auto command : {Command::STEP, Command::SKIP, Command::RETRY, Command::SPEED,
                             Command::LAMPS, Command::ANSWER, Command::RELEASE_CONTROL}) {
    two.send("bob", command, "50 %");
    CHECK(two.control.holder == "alice");
    CHECK(two.state() == procedure_state_t::HELD);
    CHECK(two.bench.events.back().code == "command-refused");
    CHECK(two.bench.events.back().text.find("alice has control") != std::string::npos);
    two.send("alice", Command::KEEP_CONTROL);
  }
  two.send("alice", Command::RESUME);
  two.send("alice", Command::RELEASE_CONTROL);
  CHECK(two.control.holder.empty());
  two.send("bob", Command::SPEED, "50 %");
  CHECK(two.bench.events.back().code == "operator-command");
}

TEST_CASE("stops are obeyed from everybody, whoever has control") {
  Operators two;
  two.send("alice", Command::TAKE_CONTROL);
  SECTION("hold") {
    two.send("bob", Command::HOLD);
    CHECK(two.state() == procedure_state_t::HELD);
    CHECK(two.bench.node->state().reason == "held by bob");
  }
  SECTION("abort") {
    two.send("supervisor", Command::ABORT);
    CHECK(two.bench.run() == procedure_state_t::ABORTED);
  }
}

TEST_CASE("control is taken from its holder only explicitly") {
  Operators two;
  two.send("alice", Command::TAKE_CONTROL, "hold");
  CHECK(two.control.holds_when_lost != 0);
  two.send("bob", Command::TAKE_CONTROL);
  CHECK(two.control.holder == "alice");
  CHECK(two.refused("no take control: alice has control"));
  two.send("bob", Command::TAKE_CONTROL, "overtake over");
  CHECK(two.control.holder == "alice");
  two.send("bob", Command::TAKE_CONTROL, " take over ,hold");
  CHECK(two.control.holder == "bob");
  CHECK(two.control.holds_when_lost != 0);
  bool published = false;
  for (const event_t& event : two.bench.events) {
    published = published || (event.code == "control-taken" &&
                              event.text.find("bob has taken control over from alice") == 0);
  }
  CHECK(published);
  // the former holder does not get it back by keeping it
  two.send("alice", Command::KEEP_CONTROL);
  two.send("alice", Command::RESUME);
  CHECK(two.control.holder == "bob");
  CHECK(two.refused("no resume: bob has control"));
}

TEST_CASE("control that is not kept lapses, and holds the procedure where requested") {
  Operators two;
  SECTION("without hold") {
    two.send("alice", Command::TAKE_CONTROL);
    two.keep("alice", 3);
    CHECK(two.control.holder == "alice");
    two.bench.run_for(2);
    CHECK(two.control.holder.empty());
    CHECK(two.bench.event_text("control-lapsed") ==
          "control of alice lapsed: no operator has control");
    CHECK(two.state() == procedure_state_t::RUNNING);
  }
  SECTION("with hold") {
    two.send("alice", Command::TAKE_CONTROL, "hold");
    two.keep("alice", 3);
    CHECK(two.state() == procedure_state_t::RUNNING);
    two.bench.run_for(2);
    CHECK(two.state() == procedure_state_t::HELD);
    CHECK(two.bench.node->state().reason == "control of alice lapsed");
    CHECK(two.bench.testbed_received(testbed_command2_t::HOLD));
    two.send("bob", Command::RESUME);
    CHECK(two.state() == procedure_state_t::RUNNING);
  }
  SECTION("one that has released it has lost nothing") {
    two.send("alice", Command::TAKE_CONTROL, "hold");
    two.send("alice", Command::RELEASE_CONTROL);
    two.bench.run_for(3);
    CHECK(two.state() == procedure_state_t::RUNNING);
    CHECK(two.bench.event_text("control-lapsed").empty());
  }
}

TEST_CASE("control lost before the first step holds it there") {
  fake::Script script;
  script.ready_after_s = 4;
  script.move_takes_s = 10;
  EngineBench bench(script, long_move);
  bench.run_for(1);
  bench.command(Command::TAKE_CONTROL, "hold");
  bench.run_for(2);
  CHECK_FALSE(bench.event_text("control-lapsed").empty());
  bench.run_to(procedure_state_t::HELD);
  CHECK(bench.node->state().current_step == 0);
  bench.run_for(2);
  bench.command(Command::RESUME);
  CHECK(bench.run() == procedure_state_t::PASS);
}

TEST_CASE("the requested speed goes to the motion under way and to later ones") {
  Operators one;
  one.send("alice", Command::SPEED, "40 %");
  CHECK(one.bench.testbed->speed_override == Approx(0.4));
  one.send("alice", Command::HOLD);
  one.send("alice", Command::SPEED, "20 %");
  CHECK(one.state() == procedure_state_t::HELD);
  CHECK(one.bench.testbed->speed_override == Approx(0.2));
  one.bench.run_for(3);  // to rest
  one.send("alice", Command::RESUME);
  CHECK(one.bench.testbed->obeyed.back().command == testbed_command2_t::RESUME);
  CHECK(one.bench.testbed->obeyed.back().speed_override == Approx(0.2));
  for (const char* wrong : {"0 %", "101 %", "-5 %", "fast", "", "50 mm/s", "nan"}) {
    one.send("alice", Command::SPEED, wrong);
    CHECK(one.bench.events.back().code == "command-refused");
    CHECK(one.bench.testbed->speed_override == Approx(0.2));
  }
}

TEST_CASE("a motion made slow has more time; one at full speed has not") {
  const bool slow = GENERATE(true, false);
  fake::Script script;
  script.move_takes_s = 30;  // as the fake testbed moves, whatever the speed
  EngineBench bench(script, long_move);
  bench.run_to(procedure_state_t::RUNNING);
  bench.command(Command::SPEED, slow ? "50 %" : "100 %");
  CHECK(bench.run() == (slow ? procedure_state_t::PASS : procedure_state_t::TIMEOUT));
}

TEST_CASE("the lamps change as far as they are named") {
  Operators one;
  one.send("alice", Command::LAMPS, "sun: 80 %, azimuth: 30 deg");
  one.bench.run_for(1);
  one.send("alice", Command::LAMPS, "albedo: 10 %");
  one.bench.run_for(1);
  const facility_command_t& last = one.bench.facility->last;
  CHECK(last.sun_lamp == Approx(0.8));
  CHECK(last.albedo_lamp == Approx(0.1));
  for (const char* wrong : {"sun: 120 %", "moon: 10 %", "sun", "}{", "sun: 10 %, sun: [", "\x01"}) {
    INFO(wrong);
    one.send("alice", Command::LAMPS, wrong);
    CHECK(one.bench.events.back().code == "command-refused");
  }
  CHECK(one.bench.facility->last.seq == last.seq);
}

TEST_CASE("the lamps keep what is not named") {
  facility_state_t now{};
  now.sun_lamp = 0.5;
  now.albedo_lamp = 0.25;
  now.sun_azimuth_rad = 1;
  now.sun_elevation_rad = -0.5;
  const facility_command_t command = procedures::lamps_of("albedo: 10 %", now);
  CHECK(command.sun_lamp == 0.5);
  CHECK(command.albedo_lamp == Approx(0.1));
  CHECK(command.sun_azimuth_rad == 1);
  CHECK(command.sun_elevation_rad == -0.5);
  CHECK(procedures::speed_override_of("60 %") == Approx(0.6));
  CHECK(procedures::speed_override_of("1") == 1);
}
