// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <berth/heartbeat_t.hpp>
#include <string>
#include <thread>

#include "common/bus/lcm_bus.h"
#include "common/bus/process_loop.h"
#include "common/core/error.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"

using namespace berth;

namespace {

/// A port of this test process alone, outside the ephemeral range.
std::string own_url() {
  return "udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 10000) + "?ttl=0";
}

}  // namespace

TEST_CASE("a queue keeps every message in order; a mailbox keeps the newest") {
  ProcessLoop loop(clock_offset_now());
  LcmBus bus(own_url(), loop);
  std::vector<std::int64_t> queued;
  std::vector<std::int64_t> latest;
  bus.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(100), [&](const heartbeat_t& m) {
    queued.push_back(m.seq);
    if (m.seq == 50) loop.stop();
  });
  bus.subscribe<heartbeat_t>(channels::heartbeat, Queue::latest(),
                             [&](const heartbeat_t& m) { latest.push_back(m.seq); });
  bus.start();
  for (std::int64_t i = 1; i <= 50; ++i) {
    heartbeat_t beat{};
    beat.seq = i;
    bus.publish(channels::heartbeat, beat);
  }
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  REQUIRE(queued.size() == 50);
  for (std::size_t i = 0; i < queued.size(); ++i)
    CHECK(queued[i] == static_cast<std::int64_t>(i + 1));
  REQUIRE_FALSE(latest.empty());
  CHECK(std::is_sorted(latest.begin(), latest.end()));
  const BusCounters counters = bus.counters();
  CHECK(counters.published == 50);
  CHECK(counters.superseded <= 50 - static_cast<std::int64_t>(latest.size()));
}

TEST_CASE("a timer that is due does not wait for the messages that wait") {
  ProcessLoop loop(clock_offset_now());
  LcmBus bus(own_url(), loop);
  constexpr int sent = 20;
  int handled = 0;
  int handled_before_timer = -1;
  bus.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(100), [&](const heartbeat_t&) {
    if (++handled == 1) {
      while (bus.counters().received < sent) std::this_thread::yield();
      loop.after(0, [&] { handled_before_timer = handled; });
    }
    if (handled == sent) loop.stop();
  });
  bus.start();
  for (int i = 0; i < sent; ++i) bus.publish(channels::heartbeat, heartbeat_t{});
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(handled == sent);
  CHECK(handled_before_timer == 1);
}

TEST_CASE("what the network does not take is counted") {
  ProcessLoop loop(clock_offset_now());
  LcmBus bus(own_url(), loop);
  bus.publish(std::string(64, 'c'), heartbeat_t{});  // LCM takes names of up to 63 characters
  CHECK(bus.counters().published == 1);
  CHECK(bus.counters().unsent == 1);
}

TEST_CASE("URLs that LCM would misread are refused") {
  CHECK_THROWS_AS(bus_url("tcpq://localhost:7700"), InputError);
  CHECK_THROWS_AS(bus_url("udpm://239.255.76.67:7667?tll=0"), InputError);
  CHECK(bus_url("udpm://239.255.76.67:7667?ttl=0").find("recv_buf_size=") != std::string::npos);
}

TEST_CASE("real sockets: dial, listen, refuse") {
  ProcessLoop loop(clock_offset_now());
  Wires& wires = loop.wires();
  const std::string address = "127.0.0.1:" + std::to_string(20000 + getpid() % 10000);
  std::unique_ptr<Wire> device;
  std::string heard;
  bool refused = false;
  wires.listen(address, [&](std::unique_ptr<Wire> wire) {
    device = std::move(wire);
    device->watch([&] {
      std::array<std::uint8_t, 16> text;
      const auto size = device->read(text);
      if (!size) {
        device.reset();
        return loop.stop();
      }
      heard.append(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(*size));
    });
  });
  wires.dial("127.0.0.1:1", [&](const std::unique_ptr<Wire>& nobody) {
    refused = nobody == nullptr;
    wires.dial(address, [&](const std::unique_ptr<Wire>& wire) {
      REQUIRE(wire);
      const std::vector<std::uint8_t> hello{'h', 'e', 'l', 'l', 'o'};
      REQUIRE(wire->write(hello) == 5);
    });
  });
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(refused);
  CHECK(heard == "hello");
  CHECK_THROWS_AS(wires.listen(address, [](const std::unique_ptr<Wire>&) {}), InputError);
  CHECK_THROWS_AS(wires.dial("nowhere", [](const std::unique_ptr<Wire>&) {}), InputError);
}
