// SPDX-License-Identifier: BSD-3-Clause
#include <modbus/modbus.h>

#include <array>
#include <optional>

#include "common/bus/simulation.h"
#include "drivers/modbus/modbus_client.h"
#include "drivers/modbus/modbus_server.h"
#include "test/catch.h"

namespace berth {
namespace {

/// A server with 100 registers and a client, in the twin.
struct Pair {
  Pair() {
    client.emplace(loop, ModbusClient::Options{"device:502", 1, 50 * millisecond},
                   [this](bool up, const std::string& why) {
                     up ? ++connections : ++losses;
                     reason = why;
                   });
  }
  void serve(int limit = 2) {
    server.emplace(
        simulation.make_loop(), ModbusServer::Options{"device:502", 1, limit, 5 * second}, image,
        [this](ModbusTable, int first, int count) {
          read = {first, count};
        },
        [this](ModbusTable, int first, int count) {
          written = {first, count};
        });
  }
  /// As a node would: from a task of the loop.
  void act(const Loop::Task& task) {
    loop.after(0, task);
    simulation.run_for(10 * millisecond);
  }
  ModbusClient::Done keep() {
    return [this](const ModbusAnswer& answer) {
      ++answers;
      error = answer.error;
      exception = answer.exception;
      words.assign(answer.words.begin(), answer.words.end());
      bits.assign(answer.bits.begin(), answer.bits.end());
      took = answer.received - answer.sent;
    };
  }

  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  ModbusImage image{100, 16, 16};
  std::optional<ModbusServer> server;
  std::optional<ModbusClient> client;
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

TEST_CASE("registers and bits go over the wire, numbered from 1") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  REQUIRE(pair.connections == 1);
  pair.image.holding(7) = 0x1234;
  pair.image.holding(8) = 0xfffe;
  pair.act([&] { pair.client->read_registers(7, 2, pair.keep()); });
  CHECK(pair.words == std::vector<Word>{0x1234, 0xfffe});
  CHECK(pair.read == std::pair{7, 2});
  CHECK(pair.took == 400);  // there and back

  const Word sent[] = {1, 2, 3};
  pair.act([&] { pair.client->write_registers(98, sent, pair.keep()); });
  CHECK(pair.error.empty());
  CHECK(pair.image.holding(100) == 3);
  CHECK(pair.written == std::pair{98, 3});

  pair.act([&] {
    pair.client->write_coil(4, true, pair.keep());
    pair.client->read_coils(3, 10, pair.keep());
    pair.image.set_input(16, true);
  });
  CHECK(pair.bits == std::vector<std::uint8_t>{0, 1, 0, 0, 0, 0, 0, 0, 0, 0});
  pair.act([&] { pair.client->read_inputs(15, 2, pair.keep()); });
  CHECK(pair.bits == std::vector<std::uint8_t>{0, 1});
  CHECK(pair.losses == 0);
}

TEST_CASE("the server refuses what it does not have, and the connection lives on") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  pair.act([&] { pair.client->read_registers(100, 2, pair.keep()); });
  CHECK(pair.exception == MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  CHECK(pair.error == "refused: Illegal data address");
  pair.act([&] { pair.client->read_registers(1, 126, pair.keep()); });
  CHECK(pair.exception == MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  pair.act([&] { pair.client->read_registers(100, 1, pair.keep()); });
  CHECK(pair.error.empty());
  CHECK(pair.answers == 3);
  CHECK(pair.losses == 0);
}

TEST_CASE("an urgent request overtakes those that wait") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  std::string order;
  const auto note = [&](char c) { return [&order, c](const ModbusAnswer&) { order += c; }; };
  pair.act([&] {
    pair.client->read_registers(1, 1, note('a'));
    pair.client->read_registers(1, 1, note('b'));
    pair.client->write_coil(1, true, note('!'), ModbusClient::Urgency::first);
  });
  CHECK(order == "a!b");
}

TEST_CASE("a silent device is given up after the time-out and dialled anew") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  pair.server->faults().silent = true;
  pair.act([&] {
    pair.client->read_registers(1, 1, pair.keep());
    pair.client->read_registers(2, 1, pair.keep());
  });
  pair.simulation.run_for(39 * millisecond);
  CHECK(pair.answers == 0);
  pair.simulation.run_for(2 * millisecond);
  CHECK(pair.answers == 2);  // the one under way, and the one behind it
  CHECK(pair.error == "no answer within 50 ms");
  CHECK_FALSE(pair.client->connected());
  pair.server->faults().silent = false;
  pair.simulation.run_for(second);
  CHECK(pair.client->connected());
  pair.act([&] { pair.client->read_registers(1, 1, pair.keep()); });
  CHECK(pair.error.empty());
}

TEST_CASE("a device that answers exceptions, garbage, too late or on a dead socket") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(second);
  const auto ask = [&](Utime patience) {
    pair.act([&] { pair.client->read_registers(1, 1, pair.keep()); });
    pair.simulation.run_for(patience);
  };
  SECTION("exception: told, and the connection lives on") {
    pair.server->faults().exception = MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY;
    ask(second);
    CHECK(pair.exception == MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
    CHECK(pair.losses == 0);
  }
  SECTION("garbage: the connection is made anew") {
    pair.server->faults().garbage = true;
    ask(0);
    CHECK(pair.error == "the device sent bytes that are not Modbus");
    CHECK(pair.losses == 1);
  }
  SECTION("late, but in time") {
    pair.server->faults().delay = 30 * millisecond;
    ask(100 * millisecond);
    CHECK(pair.error.empty());
    CHECK(pair.answers == 1);
  }
  SECTION("too late") {
    pair.server->faults().delay = 70 * millisecond;
    ask(100 * millisecond);
    CHECK(pair.error == "no answer within 50 ms");
  }
  SECTION("half open: nobody is told; a new connection works, the dead one holds its place") {
    pair.server->half_open();
    ask(40 * millisecond);
    CHECK(pair.error == "no answer within 50 ms");
    pair.simulation.run_for(second);
    ask(0);
    CHECK(pair.error.empty());
    CHECK(pair.server->connections() == 2);
    pair.simulation.run_for(3 * second);  // the idle time-out of this server
    pair.simulation.run_for(3 * second);
    CHECK(pair.server->connections() <= 1);
  }
}

TEST_CASE("the client waits for a device that starts later, asking ever more rarely") {
  Pair pair;
  int dials = 0;
  pair.simulation.run_for(10 * second);
  pair.client->read_registers(1, 1, pair.keep());
  CHECK(pair.error == "not connected");
  pair.simulation.make_loop().wires().listen(
      "device:502", [&](const std::unique_ptr<Wire>&) { ++dials; });  // and closes it
  pair.simulation.run_for(20 * second);
  CHECK(dials >= 8);
  CHECK(dials <= 11);  // every 2 s
}

TEST_CASE("connections beyond the limit are refused until one is free") {
  Pair pair;
  pair.serve(1);
  pair.simulation.run_for(second);
  int second_connections = 0;
  int second_losses = 0;
  ModbusClient late(pair.simulation.make_loop(), {"device:502"}, [&](bool up, const std::string&) {
    ++(up ? second_connections : second_losses);
  });
  pair.simulation.run_for(100 * millisecond);
  CHECK(second_losses == 1);
  CHECK(pair.server->connections() == 1);
  CHECK(pair.losses == 0);
  pair.client.reset();
  pair.simulation.run_for(5 * second);
  CHECK(late.connected());
}

TEST_CASE("a connection that says nothing for long is closed by the server") {
  Pair pair;
  pair.serve();
  pair.simulation.run_for(4 * second);
  CHECK(pair.losses == 0);
  pair.simulation.run_for(3 * second);
  CHECK(pair.losses == 1);
}

/// A device whose every byte the test chooses.
struct BadDevice {
  explicit BadDevice(std::vector<std::vector<std::uint8_t>> pieces, Utime pause = millisecond) {
    SimulatedLoop& loop = simulation.make_loop();
    loop.wires().listen("device:502", [=, this, &loop](std::unique_ptr<Wire> accepted) {
      wire = std::move(accepted);
      wire->watch([=, this, &loop] {
        std::array<std::uint8_t, 300> request;
        if (!wire->read(request)) return wire.reset();
        Utime delay = 0;
        for (const auto& piece : pieces) {
          loop.after(delay += pause, [this, piece] {
            if (wire) wire->write(piece);
          });
        }
      });
    });
    SimulatedLoop& own = simulation.make_loop();
    client.emplace(own, ModbusClient::Options{"device:502"}, nullptr);
    simulation.run_for(second);
    own.after(0, [this] {
      client->read_registers(1, 1, [this](const ModbusAnswer& answer) {
        ++answers;
        error = answer.error;
        if (answer.ok()) word = answer.words[0];
      });
    });
    simulation.run_for(80 * millisecond);
  }
  Simulation simulation;
  std::unique_ptr<Wire> wire;
  std::optional<ModbusClient> client;
  int answers = 0;
  std::string error = "none came";
  int word = -1;
};

TEST_CASE("an answer in single bytes is put together; anything wrong closes the connection") {
  const std::vector<std::uint8_t> good{0, 0, 0, 0, 0, 5, 1, 3, 2, 0x12, 0x34};
  std::vector<std::vector<std::uint8_t>> bytes;
  for (const std::uint8_t byte : good) bytes.push_back({byte});
  BadDevice slow(bytes);
  CHECK(slow.error.empty());
  CHECK(slow.word == 0x1234);
  CHECK(slow.client->connected());

  const auto spoilt = [&](std::size_t at, std::uint8_t value) {
    std::vector<std::uint8_t> frame = good;
    frame[at] = value;
    BadDevice device({frame});
    CHECK(device.answers == 1);
    CHECK_FALSE(device.client->connected());
    return device.error;
  };
  CHECK(spoilt(1, 9) == "answer to another transaction");
  CHECK(spoilt(2, 9) == "the device sent bytes that are not Modbus");
  CHECK(spoilt(4, 9) == "the device sent bytes that are not Modbus");
  CHECK(spoilt(6, 9) == "answer of another unit");
  CHECK(spoilt(7, 4) == "answer to another function");
  CHECK(spoilt(8, 4) == "short answer: 3 of 3 bytes");
  CHECK(spoilt(5, 9) == "no answer within 50 ms");  // announces more than it sends

  BadDevice verbose({good, good});
  CHECK(verbose.error.empty());
  CHECK_FALSE(verbose.client->connected());  // nobody asked for the second one
}

TEST_CASE("a client that sends anything but Modbus is cut off, the others are served on") {
  Pair pair;
  pair.serve(4);
  pair.simulation.run_for(second);
  SimulatedLoop& loop = pair.simulation.make_loop();
  int gone = 0;
  std::vector<std::unique_ptr<Wire>> intruders;
  const auto intrude = [&](std::vector<std::uint8_t> bytes) {
    loop.wires().dial("device:502", [&, bytes](std::unique_ptr<Wire> dialled) {
      REQUIRE(dialled->write(bytes) == bytes.size());
      Wire& wire = *intruders.emplace_back(std::move(dialled));
      wire.watch([&] {
        std::array<std::uint8_t, 300> answer;
        if (wire.read(answer)) return;
        wire.unwatch();
        ++gone;
      });
    });
    pair.simulation.run_for(10 * millisecond);
  };
  intrude(std::vector<std::uint8_t>(300, 'x'));
  CHECK(gone == 1);
  intrude({0, 1, 0, 0, 0, 0});  // shorter than any frame can be, and no more comes
  CHECK(gone == 1);
  intrude({0, 1, 0, 0, 0, 2, 1, 3});  // a read that does not say what: an exception
  CHECK(gone == 1);
  // FC16 that announces 123 registers and brings one
  intrude({0, 1, 0, 0, 0, 9, 1, 16, 0, 0, 0, 123, 246, 1, 2});
  pair.act([&] { pair.client->read_registers(1, 1, pair.keep()); });
  CHECK(pair.error.empty());
  CHECK(pair.words == std::vector<Word>{0});
}

}  // namespace
}  // namespace berth
