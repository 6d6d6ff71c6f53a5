// SPDX-License-Identifier: BSD-3-Clause
#include <modbus/modbus.h>

#include <memory>

#include "common/bus/simulation.h"
#include "drivers/registers/register_link.h"
#include "drivers/registers/register_server.h"
#include "test/catch.h"

namespace berth {
namespace {

/// A server with 100 registers and a link, in the twin.
struct Pair {
  explicit Pair(int unit = 1) {
    link = make_register_link(loop, {"device:502", unit}, [this](bool up, const std::string& why) {
      up ? ++connections : ++losses;
      reason = why;
    });
  }
  void serve(int limit = 2) {
    server = serve_registers(
        simulation.make_loop(), {"device:502", 1, limit, 5 * second}, image,
        [this](RegisterTable, int first, int count) {
          read = {first, count};
        },
        [this](RegisterTable, int first, int count) {
          written = {first, count};
        });
  }
  /// As a node would: from a task of the loop.
  void act(const Loop::Task& task) {
    loop.after(0, task);
    simulation.run_for(10 * millisecond);
  }
  RegisterLink::Done keep() {
    return [this](const RegisterAnswer& answer) {
      ++answers;
      error = answer.error;
      exception = answer.exception;
      words = answer.words;
      bits = answer.bits;
      took = answer.received - answer.sent;
    };
  }

  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  RegisterImage image{100, 16, 16};
  std::unique_ptr<RegisterServer> server;
  std::unique_ptr<RegisterLink> link;
  std::pair<int, int> read, written;
  int connections = 0;
  int losses = 0;
  std::string reason;
  int answers = 0;
  std::string error;
  int exception = 0;
  std::vector<Word> words;
  std::vector<std::uint8_t> bits;
  Utime took = 0;
};

TEST_CASE("registers and bits go to the device and back, numbered from 1") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  REQUIRE(pair.connections == 1);
  pair.image.holding(7) = 0x1234;
  pair.image.holding(8) = 0xfffe;
  pair.act([&] { pair.link->read_registers(7, 2, pair.keep()); });
  CHECK(pair.words == std::vector<Word>{0x1234, 0xfffe});
  CHECK(pair.read == std::pair{7, 2});
  CHECK(pair.took == 400);  // there and back

  const Word sent[] = {1, 2, 3};
  pair.act([&] { pair.link->write_registers(98, sent, pair.keep()); });
  CHECK(pair.error.empty());
  CHECK(pair.image.holding(100) == 3);
  CHECK(pair.written == std::pair{98, 3});

  pair.act([&] {
    pair.link->write_coil(4, true, pair.keep());
    pair.link->read_coils(3, 10, pair.keep());
    pair.image.set_input(16, true);
  });
  CHECK(pair.bits == std::vector<std::uint8_t>{0, 1, 0, 0, 0, 0, 0, 0, 0, 0});
  pair.act([&] { pair.link->read_inputs(15, 2, pair.keep()); });
  CHECK(pair.bits == std::vector<std::uint8_t>{0, 1});
  CHECK(pair.losses == 0);
}

TEST_CASE("the server refuses what it does not have, and the connection lives on") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  pair.act([&] { pair.link->read_registers(100, 2, pair.keep()); });
  CHECK(pair.exception == MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  CHECK(pair.error == "refused: Illegal data address");
  pair.act([&] { pair.link->read_registers(1, 126, pair.keep()); });
  CHECK(pair.error == "126 in one request, expected 1 to 125");
  pair.act([&] { pair.link->read_registers(100, 1, pair.keep()); });
  CHECK(pair.error.empty());
  CHECK(pair.answers == 3);
  CHECK(pair.losses == 0);
}

TEST_CASE("a device answers to its unit, and behind no gateway to 0 and 255") {
  const auto [unit, exception] = GENERATE(
      table<int, int>({{1, 0}, {0, 0}, {255, 0}, {2, int{MODBUS_EXCEPTION_GATEWAY_TARGET}}}));
  Pair pair(unit);
  pair.serve();
  pair.simulation.run_for(second);
  pair.act([&] { pair.link->read_registers(1, 1, pair.keep()); });
  CHECK(pair.answers == 1);
  CHECK(pair.exception == exception);
}

TEST_CASE("an urgent request overtakes those that wait") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  std::string order;
  const auto note = [&](char c) { return [&order, c](const RegisterAnswer&) { order += c; }; };
  pair.act([&] {
    pair.link->read_registers(1, 1, note('a'));
    pair.link->read_registers(1, 1, note('b'));
    pair.link->write_coil(1, true, note('!'), RegisterLink::Urgency::first);
  });
  CHECK(order == "a!b");
}

TEST_CASE("a silent device is given up after the time-out and dialled anew") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  pair.server->faults().silent = true;
  pair.act([&] {
    pair.link->read_registers(1, 1, pair.keep());
    pair.link->read_registers(2, 1, pair.keep());
  });
  pair.simulation.run_for(39 * millisecond);
  CHECK(pair.answers == 0);
  pair.simulation.run_for(2 * millisecond);
  CHECK(pair.answers == 2);  // the one under way, and the one behind it
  CHECK(pair.error == "no answer within 50 ms");
  CHECK_FALSE(pair.link->connected());
  pair.server->faults().silent = false;
  pair.simulation.run_for(second);
  CHECK(pair.link->connected());
  pair.act([&] { pair.link->read_registers(1, 1, pair.keep()); });
  CHECK(pair.error.empty());
}

TEST_CASE("a device that answers exceptions, garbage, too late or on a dead socket") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  const auto request = [&](Utime patience) {
    pair.act([&] { pair.link->read_registers(1, 1, pair.keep()); });
    pair.simulation.run_for(patience);
  };
  SECTION("exception: reported, and the connection lives on") {
    pair.server->faults().exception = MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY;
    request(second);
    CHECK(pair.exception == MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
    CHECK(pair.losses == 0);
  }
  SECTION("garbage: the connection is made anew") {
    pair.server->faults().garbage = true;
    request(0);
    CHECK(pair.error == "the device sent bytes that are not Modbus");
    CHECK(pair.losses == 1);
  }
  SECTION("late, but in time") {
    pair.server->faults().delay = 30 * millisecond;
    request(100 * millisecond);
    CHECK(pair.error.empty());
    CHECK(pair.answers == 1);
  }
  SECTION("too late") {
    pair.server->faults().delay = 70 * millisecond;
    request(100 * millisecond);
    CHECK(pair.error == "no answer within 50 ms");
  }
  SECTION("half open: without notice; a new connection works, the dead one holds its place") {
    pair.server->half_open(0);
    request(40 * millisecond);
    CHECK(pair.error == "no answer within 50 ms");
    pair.simulation.run_for(second);
    request(0);
    CHECK(pair.error.empty());
    CHECK(pair.server->connections() == 2);
    pair.simulation.run_for(3 * second);  // the idle time-out of this server
    pair.simulation.run_for(3 * second);
    CHECK(pair.server->connections() <= 1);
  }
}

TEST_CASE("the link waits for a device that starts later, dialling ever more rarely") {
  Pair pair;
  pair.simulation.run_for(10 * second);
  pair.link->read_registers(1, 1, pair.keep());
  CHECK(pair.error == "not connected");
  pair.serve(0);  // accepts and closes
  pair.simulation.run_for(20 * second);
  CHECK(pair.losses == pair.connections);
  CHECK(pair.losses >= 8);
  CHECK(pair.losses <= 11);  // every 2 s
}

TEST_CASE("connections beyond the limit are refused until one is free") {
  Pair pair;
  pair.serve(1);
  pair.simulation.run_for(second);
  int second_connections = 0;
  int second_losses = 0;
  const auto late = make_register_link(
      pair.simulation.make_loop(), {"device:502"},
      [&](bool up, const std::string&) { ++(up ? second_connections : second_losses); });
  pair.simulation.run_for(100 * millisecond);
  CHECK(second_losses == 1);
  CHECK(pair.server->connections() == 1);
  CHECK(pair.losses == 0);
  pair.link.reset();
  pair.simulation.run_for(5 * second);
  CHECK(late->connected());
}

TEST_CASE("a connection that is silent for long is closed by the server") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(4 * second);
  CHECK(pair.losses == 0);
  pair.simulation.run_for(3 * second);
  CHECK(pair.losses == 1);
}

}  // namespace
}  // namespace berth
