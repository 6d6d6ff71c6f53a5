// SPDX-License-Identifier: BSD-3-Clause
#include <berth/heartbeat_t.hpp>
#include <string>

#include "common/bus/simulation.h"
#include "common/bus/wire.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"

namespace berth {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

/// All that has come; "(gone)" behind it once the peer is.
std::string take(Wire& wire) {
  std::string text;
  std::array<std::uint8_t, 64> piece;
  while (const auto size = wire.read(piece)) {
    if (*size == 0) return text;
    text.append(piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(*size));
  }
  return text + "(gone)";
}

/// A driver's wire to a device, joined in the twin; both ends keep what they hear and when.
struct Joined {
  Joined() {
    device_loop.wires().listen("device:1", [this](std::unique_ptr<Wire> wire) {
      device = std::move(wire);
      device->watch([this] { hear(*device, device_heard); });
    });
    driver_loop.wires().dial("device:1", [this](std::unique_ptr<Wire> wire) {
      driver = std::move(wire);
      driver->watch([this] { hear(*driver, driver_heard); });
    });
    simulation.run_for(second);
    REQUIRE(driver);
    REQUIRE(device);
  }
  void hear(Wire& wire, std::string& heard) {
    heard += take(wire);
    heard_at = simulation.now();
    if (heard.ends_with("(gone)")) wire.unwatch();
  }

  Simulation simulation;
  SimulatedLoop& device_loop = simulation.make_loop();
  SimulatedLoop& driver_loop = simulation.make_loop();
  std::unique_ptr<Wire> device, driver;
  std::string device_heard, driver_heard;
  Utime heard_at = 0;
};

TEST_CASE("bytes written on a wire are seen one wire latency later, in both directions") {
  Joined joined;
  const Utime begin = joined.simulation.now();
  CHECK(joined.driver->write(bytes_of("ping")) == 4);
  joined.simulation.run_for(199);
  CHECK(joined.device_heard.empty());
  joined.simulation.run_for(millisecond);
  CHECK(joined.device_heard == "ping");
  CHECK(joined.heard_at - begin == 200);
  const Utime answered = joined.simulation.now();
  CHECK(joined.device->write(bytes_of("pong")) == 4);
  joined.simulation.run_for(millisecond);
  CHECK(joined.driver_heard == "pong");
  CHECK(joined.heard_at - answered == 200);
}

TEST_CASE("where nobody listens there is no wire") {
  Simulation simulation;
  bool refused = false;
  simulation.make_loop().wires().dial(
      "device:1", [&](const std::unique_ptr<Wire>& wire) { refused = wire == nullptr; });
  simulation.run_for(millisecond);
  CHECK(refused);
}

TEST_CASE("what was written before the peer closed is read before its end is told") {
  Joined joined;
  CHECK(joined.driver->write(bytes_of("last words")) == 10);
  joined.driver.reset();
  joined.simulation.run_for(millisecond);
  CHECK(joined.device_heard == "last words(gone)");
  CHECK_FALSE(joined.device->write(bytes_of("anybody?")));
}

TEST_CASE("bytes that were not read are told of again; nobody is told who does not watch") {
  Joined joined;
  int told = 0;
  joined.device->watch([&] {
    std::array<std::uint8_t, 2> two;
    REQUIRE(joined.device->read(two) == 2);
    ++told;
  });
  CHECK(joined.driver->write(bytes_of("sixsix")) == 6);
  joined.simulation.run_for(millisecond);
  CHECK(told == 3);
  joined.device->unwatch();
  CHECK(joined.driver->write(bytes_of("xx")) == 2);
  joined.simulation.run_for(millisecond);
  CHECK(told == 3);
  CHECK(take(*joined.device) == "xx");
}

TEST_CASE("a peer that reads nothing is given only so much") {
  Joined joined;
  joined.device->unwatch();
  const std::vector<std::uint8_t> much(100000);
  std::size_t taken = 0;
  for (int i = 0; i < 10; ++i) taken += joined.driver->write(much).value_or(0);
  CHECK(taken > much.size());
  CHECK(taken < 3 * much.size());
  CHECK(joined.driver->write(much) == 0);
}

TEST_CASE("a wire may be closed by whoever is told of its bytes") {
  Joined joined;
  joined.device->watch([&] { joined.device.reset(); });
  CHECK(joined.driver->write(bytes_of("x")) == 1);
  joined.simulation.run_for(millisecond);
  CHECK_FALSE(joined.device);
  CHECK(joined.driver_heard == "(gone)");
}

TEST_CASE("a stopped node hears what has come once it goes on") {
  Joined joined;
  SimulatedBus& bus = joined.simulation.make_bus();
  joined.simulation.stop(joined.device_loop, bus);
  CHECK(joined.driver->write(bytes_of("wake up")) == 7);
  joined.simulation.run_for(second);
  CHECK(joined.device_heard.empty());
  joined.simulation.go_on(joined.device_loop, bus);
  joined.simulation.run_for(millisecond);
  CHECK(joined.device_heard == "wake up");
}

}  // namespace
}  // namespace berth
