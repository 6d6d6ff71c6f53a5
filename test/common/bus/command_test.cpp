// SPDX-License-Identifier: BSD-3-Clause
// Commands and their answers: the sender learns the outcome, whatever is lost on the way.
#include <berth/facility_command_t.hpp>
#include <map>
#include <memory>
#include <vector>

#include "common/bus/commands.h"
#include "common/bus/simulation.h"
#include "test/catch.h"

using namespace berth;

namespace {

/// A node that refuses lamps above 100 %, and what reaches its commanders.
struct Exchange {
  Exchange() {
    node_bus.subscribe<facility_command_t>(
        "COMMAND", Queue::fifo(), [this](const facility_command_t& command) {
          ++received;
          if (unresponsive || !answers->is_new(command)) return;
          obeyed[command.commander].push_back(command.seq);
          if (command.sun_lamp > 1) {
            answers->refuse(command, "found " + std::to_string(command.sun_lamp));
          } else {
            answers->accept(command);
          }
        });
    bus.subscribe<command_answers_t>("ANSWERS", Queue::fifo(), [this](const command_answers_t& a) {
      last = a;
      for (auto& client : clients) client->on(a);
    });
    loop.every(50 * millisecond, [this] {
      for (auto& client : clients) client->tick(simulation.now());
    });
  }

  CommandClient<facility_command_t>& client() {
    clients.push_back(std::make_unique<CommandClient<facility_command_t>>(
        [this](const facility_command_t& command) { bus.publish("COMMAND", command); }));
    return *clients.back();
  }
  static facility_command_t lamps(double sun) {
    facility_command_t command{};
    command.sun_lamp = sun;
    return command;
  }
  void run_for(double s) { simulation.run_for(utime_from_seconds(s)); }

  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  SimulatedBus& bus = simulation.make_bus();
  SimulatedLoop& node_loop = simulation.make_loop();
  SimulatedBus& node_bus = simulation.make_bus();
  std::unique_ptr<CommandAnswers> answers =
      std::make_unique<CommandAnswers>(node_bus, node_loop, "ANSWERS", 7);
  std::vector<std::unique_ptr<CommandClient<facility_command_t>>> clients;
  std::map<std::string, std::vector<std::int64_t>> obeyed;
  command_answers_t last{};
  int received = 0;
  bool unresponsive = false;
};

}  // namespace

TEST_CASE("a command is answered at once, and not repeated then") {
  Exchange exchange;
  Commander me{"me", 7, 0};
  auto& client = exchange.client();
  CHECK(client.status() == CommandStatus::none);
  client.send(Exchange::lamps(0.5), me, exchange.simulation.now());
  CHECK(client.pending());
  exchange.run_for(0.01);
  CHECK(client.status() == CommandStatus::accepted);
  client.send(Exchange::lamps(2), me, exchange.simulation.now());
  exchange.run_for(0.01);
  CHECK(client.status() == CommandStatus::refused);
  CHECK(client.reason() == "found 2.000000");
  exchange.run_for(3);
  CHECK(exchange.received == 2);
  CHECK(exchange.obeyed["me"] == std::vector<std::int64_t>{1, 2});
}

TEST_CASE("two commanders with the same numbers each get their own answers, through any loss") {
  Exchange exchange;
  exchange.simulation.set_bus_loss(0.6);
  Commander one{"one", 7, 0};
  Commander two{"two", 7, 0};
  auto& first = exchange.client();
  auto& second = exchange.client();
  for (int i = 0; i < 20; ++i) {
    INFO(i);
    first.send(Exchange::lamps(0.5), one, exchange.simulation.now());
    second.send(Exchange::lamps(3), two, exchange.simulation.now());
    exchange.run_for(12);
    CHECK(first.status() == CommandStatus::accepted);
    CHECK(second.status() == CommandStatus::refused);
  }
  CHECK(exchange.received > 45);  // repeated
  CHECK(exchange.obeyed["one"].size() == 20);
  CHECK(exchange.obeyed["two"].size() == 20);
}

TEST_CASE("a command without an answer is repeated until its time limit, or without end") {
  Exchange exchange;
  exchange.unresponsive = true;
  Commander me{"me", 7, 0};
  auto& limited = exchange.client();
  auto& patient = exchange.client();
  limited.send(Exchange::lamps(0), me, exchange.simulation.now(), 3 * second);
  patient.send(Exchange::lamps(0), me, exchange.simulation.now());
  exchange.run_for(2.9);
  CHECK(limited.pending());
  CHECK(exchange.received == 12);  // at once and every half a second
  exchange.run_for(0.2);
  CHECK(limited.status() == CommandStatus::unanswered);
  CHECK(limited.reason() == "no answer within 3.0 s");
  exchange.run_for(60);
  CHECK(patient.pending());
  exchange.unresponsive = false;
  exchange.run_for(1);
  CHECK(patient.status() == CommandStatus::accepted);
  CHECK(exchange.obeyed["me"] == std::vector<std::int64_t>{2});
}

TEST_CASE("a stop is repeated faster than a motion") {
  testbed_command2_t command{};
  command.command = testbed_command2_t::MOVE;
  CHECK(repeat_period_of(command) == 500 * millisecond);
  for (const std::int8_t stop : {testbed_command2_t::HOLD, testbed_command2_t::STOP}) {
    command.command = stop;
    CHECK(repeat_period_of(command) == 100 * millisecond);
  }
}

TEST_CASE("a motion that was accepted may still be finished, or given up with a reason") {
  std::vector<testbed_command2_t> sent;
  CommandClient<testbed_command2_t> client(
      [&sent](const testbed_command2_t& command) { sent.push_back(command); });
  Commander me{"me", 7, 100};
  client.send({}, me, second);
  REQUIRE(sent.size() == 1);
  CHECK(sent[0].seq == 101);
  CHECK(sent[0].utime_expires == 3 * second);
  testbed_state_t state{};
  state.command_seq = 100;  // another
  CHECK_FALSE(client.on(state));
  state.command_seq = 101;
  CHECK(client.on(state));
  CHECK_FALSE(client.on(state));
  client.tick(10 * second);
  CHECK(sent.size() == 1);
  SECTION("finished") {
    state.finished_seq = 101;
    CHECK(client.on(state));
    CHECK(client.status() == CommandStatus::finished);
  }
  SECTION("given up") {
    state.refused_seq = 101;
    state.refusal = "the corridor was left";
    CHECK(client.on(state));
    CHECK(client.status() == CommandStatus::refused);
    CHECK(client.reason() == "the corridor was left");
  }
}

TEST_CASE("answers are published for ten seconds, and fit into a message whatever the commanders") {
  Exchange exchange;
  Commander me{"me", 7, 0};
  Commander huge{std::string(59900, 'x'), 7, 0};
  exchange.client().send(Exchange::lamps(0), me, exchange.simulation.now());
  exchange.client().send(Exchange::lamps(0), huge, exchange.simulation.now(), second);
  exchange.run_for(2);
  CHECK(exchange.clients[0]->status() == CommandStatus::accepted);
  CHECK(exchange.last.answer_count == 1);
  for (int i = 0; i < 40; ++i) {
    exchange.client().send(Exchange::lamps(0), me, exchange.simulation.now());
    exchange.run_for(0.01);
  }
  CHECK(exchange.last.answer_count == 16);
  CHECK(exchange.last.answers[0].seq == 41);
  exchange.run_for(11);
  const std::int64_t messages = exchange.last.seq;
  exchange.run_for(10);
  CHECK(exchange.last.seq == messages);
}
