// SPDX-License-Identifier: BSD-3-Clause
// Operators' commands to an engine, and its answers.
#include "app/terminal/procedure_client.h"

#include "logs/file/log_reader.h"
#include "test/procedures/engine/engine_bench.h"

using namespace berth;

namespace {

struct Ending {
  CommandStatus status = CommandStatus::pending;
  std::string reason;
  int times = 0;
};

struct Operators {
  Ending& send(std::int8_t what, const std::string& text = "", const std::string& commander = "") {
    procedure_command_t command{};
    command.command = what;
    command.text = text;
    command.commander = commander;
    Ending& ending = endings.emplace_back();
    client.send(command, [&ending](CommandStatus status, const std::string& reason) {
      ending = {status, reason, ending.times + 1};
    });
    return ending;
  }
  int events(const std::string& code) const {
    return static_cast<int>(std::count_if(bench.events.begin(), bench.events.end(),
                                          [&](const event_t& e) { return e.code == code; }));
  }

  fake::EngineBench bench{{}, fake::procedure_of("  - wait: 100 s\n")};
  SimulatedLoop& loop = bench.simulation.make_loop();
  ProcedureClient client{bench.simulation.make_bus(), loop, fake::session, "me"};
  std::deque<Ending> endings;
};

}  // namespace

TEST_CASE("an accepted command is reported at once, a refused one with its reason") {
  Operators o;
  o.bench.run_to(procedure_state_t::RUNNING);
  const Ending& step = o.send(procedure_command_t::STEP);
  const Ending& skip = o.send(procedure_command_t::SKIP);
  o.bench.run_for(0.01);
  CHECK(step.status == CommandStatus::accepted);
  CHECK(skip.status == CommandStatus::refused);
  CHECK(skip.reason == "a reason is needed, for the record");
  o.bench.run_for(3);
  CHECK(step.times == 1);
  CHECK(skip.times == 1);
}

TEST_CASE("two operators get their own answers and are obeyed once, however much is lost") {
  Operators o;
  o.bench.run_to(procedure_state_t::RUNNING);
  o.bench.simulation.set_bus_loss(0.5);
  for (int i = 0; i < 5; ++i) {
    const Ending& mine = o.send(procedure_command_t::RESUME);
    const Ending& theirs = o.send(procedure_command_t::SPEED, "50 %", "somebody else");
    o.bench.run_for(1.9);  // nothing here rests on events
    CHECK(mine.status == CommandStatus::refused);
    CHECK(mine.reason == "nothing is held");
    CHECK(theirs.status == CommandStatus::accepted);
  }
  o.bench.simulation.set_bus_loss(0);
  std::map<std::string, int> obeyed;  // as the log has it
  o.bench.writer->flush();
  logs::LogReader reader(o.bench.log);
  for (logs::LogEvent event; reader.next(event);) {
    if (event.channel != channels::event) continue;
    const auto message = logs::decode<event_t>(event.data);
    if (message && message->code == "operator-command") ++obeyed[message->text];
  }
  CHECK(obeyed == std::map<std::string, int>{{"me: resume", 5}, {"somebody else: speed: 50 %", 5}});
}

TEST_CASE("a command to no engine is given up after 2 s, a stop never") {
  Operators o;
  o.bench.run_to(procedure_state_t::RUNNING);
  o.bench.simulation.set_bus_loss(1);
  const Ending& resume = o.send(procedure_command_t::RESUME);
  const Ending& hold = o.send(procedure_command_t::HOLD);
  o.bench.run_for(1.9);
  CHECK(resume.status == CommandStatus::pending);
  o.bench.run_for(0.2);
  CHECK(resume.status == CommandStatus::unanswered);
  CHECK(resume.reason == "no answer within 2.0 s");
  o.bench.run_for(20);
  CHECK(hold.status == CommandStatus::pending);
  o.bench.simulation.set_bus_loss(0);
  o.bench.run_for(0.3);
  CHECK(hold.status == CommandStatus::accepted);
}

TEST_CASE("commands that are late or of another run are refused, but stops are obeyed") {
  Operators o;
  o.bench.run_to(procedure_state_t::RUNNING);
  ProcedureClient other(o.bench.simulation.make_bus(), o.loop, fake::session + 1, "other");
  Ending step;
  Ending hold;
  const auto into = [](Ending& ending) {
    return [&ending](CommandStatus status, const std::string& reason) {
      ending = {status, reason, ending.times + 1};
    };
  };
  procedure_command_t command{};
  command.command = procedure_command_t::STEP;
  other.send(command, into(step));
  o.bench.run_for(0.1);
  CHECK(step.status == CommandStatus::refused);
  CHECK(step.reason.find("it belongs to session " + std::to_string(fake::session + 1)) == 0);
  command.command = procedure_command_t::HOLD;
  other.send(command, into(hold));
  o.bench.run_for(0.1);
  CHECK(hold.status == CommandStatus::accepted);
  CHECK(o.bench.node->state().state == procedure_state_t::HELD);
  const Ending& end = o.send(procedure_command_t::ABORT);
  REQUIRE(o.bench.run() == procedure_state_t::ABORTED);
  CHECK(end.status == CommandStatus::accepted);
  const Ending& late = o.send(procedure_command_t::ABORT);
  o.bench.run_for(0.1);
  CHECK(late.status == CommandStatus::refused);
  CHECK(late.reason == "the procedure has finished");
}
