// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <berth/heartbeat_t.hpp>
#include <string>

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

TEST_CASE("URLs that LCM would misread are refused") {
  CHECK_THROWS_AS(bus_url("tcpq://localhost:7700"), InputError);
  CHECK_THROWS_AS(bus_url("udpm://239.255.76.67:7667?tll=0"), InputError);
  CHECK(bus_url("udpm://239.255.76.67:7667?ttl=0").find("recv_buf_size=") != std::string::npos);
}

TEST_CASE("real sockets: dial, listen, refuse") {
  ProcessLoop loop(clock_offset_now());
  TcpWires wires(loop);
  const std::string address = "127.0.0.1:" + std::to_string(20000 + getpid() % 10000);
  std::string heard;
  int refused = 0;
  wires.listen(address, [&](int fd) {
    loop.watch(fd, [&, fd] {
      char text[16];
      const auto n = read(fd, text, sizeof text);
      if (n <= 0) {
        loop.unwatch(fd);
        close(fd);
        loop.stop();
        return;
      }
      heard.append(text, static_cast<std::size_t>(n));
    });
  });
  wires.dial("127.0.0.1:1", [&](int fd) {
    refused = fd;
    wires.dial(address, [&](int connected) {
      REQUIRE(connected >= 0);
      REQUIRE(write(connected, "hello", 5) == 5);
      close(connected);
    });
  });
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(refused == -1);
  CHECK(heard == "hello");
  CHECK_THROWS_AS(wires.listen(address, [](int) {}), InputError);
  CHECK_THROWS_AS(wires.dial("nowhere", [](int) {}), InputError);
}
