// SPDX-License-Identifier: BSD-3-Clause
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <berth/heartbeat_t.hpp>
#include <berth/node_status_t.hpp>
#include <future>
#include <string>
#include <thread>

#include "common/bus/lcm_bus.h"
#include "common/bus/node.h"
#include "common/bus/process_loop.h"
#include "common/bus/sockets.h"
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

namespace {

class WorkingNode final : public Node {
 public:
  using Node::Node;
  ~WorkingNode() override { end_work(); }
  void do_work(Worker::Job job) { work(std::move(job)); }
  void become_ready() { report(node_status_t::READY); }
};

}  // namespace

TEST_CASE("a node at work beats and reports that its work takes too long") {
  ProcessLoop loop(clock_offset_now());
  LcmBus bus(own_url(), loop);
  WorkingNode node({"working", 42, ""}, bus, loop);
  node.become_ready();
  std::promise<void> enough;
  int beats = 0;
  std::vector<node_status_t> statuses;
  bus.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(100), [&](const heartbeat_t&) {
    if (++beats == 4) enough.set_value();
  });
  bus.subscribe<node_status_t>(channels::node_status, Queue::fifo(100),
                               [&](const node_status_t& s) {
                                 statuses.push_back(s);
                                 if (statuses.size() > 1 && s.state == node_status_t::READY)
                                   loop.stop();
                               });
  bus.start();
  const auto loop_thread = std::this_thread::get_id();
  bool elsewhere = false;
  bool back = false;
  node.do_work({"long work", millisecond,
                [&, future = std::make_shared<std::future<void>>(enough.get_future())] {
                  elsewhere = std::this_thread::get_id() != loop_thread;
                  future->wait();  // an endless one, did the beats wait for it
                },
                [&] { back = std::this_thread::get_id() == loop_thread; }});
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(beats >= 4);
  CHECK(elsewhere);
  CHECK(back);
  REQUIRE(statuses.size() >= 2);
  CHECK(statuses[statuses.size() - 2].state == node_status_t::FAULT);
  CHECK_THAT(statuses[statuses.size() - 2].reason,
             Catch::Matchers::Contains("long work takes longer than its budget"));
  CHECK(statuses.back().state == node_status_t::READY);
}

TEST_CASE("jobs of a worker run in their order; an exception reaches the loop") {
  ProcessLoop loop(clock_offset_now());
  const auto worker = loop.make_worker();
  std::string done;
  for (const char* const name : {"a", "b", "c"}) {
    worker->give({name, second, [&done, name] { done += name; }, [] {}});
  }
  worker->give({"bad", second, [] { throw InputError("it went wrong"); }, [] {}});
  loop.after(20 * second, [&] { loop.stop(); });
  CHECK_THROWS_WITH(loop.run(), "it went wrong");
  CHECK(done == "abc");
  CHECK(worker->waiting() == 0);
}

TEST_CASE("messages that the network does not take are counted") {
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
  Sockets& sockets = loop.sockets();
  const std::string address = "127.0.0.1:" + std::to_string(20000 + getpid() % 10000);
  Socket device;
  std::string received;
  bool refused = false;
  sockets.listen(address, [&](Socket socket) {
    device = std::move(socket);
    loop.watch(device.fd(), [&] {
      std::array<std::uint8_t, 16> text;
      const auto size = device.read(text);
      if (!size) {
        loop.unwatch(device.fd());
        return loop.stop();
      }
      received.append(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(*size));
    });
  });
  sockets.dial("127.0.0.1:1", [&](const Socket& refusing) {
    refused = refusing.fd() < 0;
    sockets.dial(address, [&](const Socket& socket) {
      REQUIRE(socket.fd() >= 0);
      const std::vector<std::uint8_t> hello{'h', 'e', 'l', 'l', 'o'};
      REQUIRE(socket.write(hello) == 5);
    });
  });
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(refused);
  CHECK(received == "hello");
  CHECK_THROWS_AS(sockets.listen(address, [](const Socket&) {}), InputError);
  CHECK_THROWS_AS(sockets.dial("nowhere", [](const Socket&) {}), InputError);
}

/// Takes no connection any more: a dialler's first packet is not answered, as by a machine that is
/// switched off.
struct UnresponsiveDevice {
  UnresponsiveDevice() {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    auto* any = reinterpret_cast<sockaddr*>(&at);
    REQUIRE(bind(sockets[0], any, size) == 0);
    REQUIRE(listen(sockets[0], 0) == 0);
    REQUIRE(getsockname(sockets[0], any, &size) == 0);
    for (std::size_t i = 1; i < sockets.size(); ++i) (void)connect(sockets[i], any, size);
    address = "127.0.0.1:" + std::to_string(ntohs(at.sin_port));
  }
  ~UnresponsiveDevice() {
    for (const int fd : sockets) close(fd);
  }
  static int make() { return socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); }

  std::array<int, 5> sockets{make(), make(), make(), make(), make()};
  std::string address;
};

TEST_CASE("a device that is switched off is given up in time, and the loop goes on meanwhile") {
  const UnresponsiveDevice unresponsive;
  ProcessLoop loop(clock_offset_now());
  Sockets& sockets = loop.sockets();
  int beats = 0;
  bool given_up = false;
  const Utime begin = loop.now();
  loop.every(5 * millisecond, [&] { ++beats; });
  sockets.dial(
      unresponsive.address,
      [&](const Socket& socket) {
        given_up = socket.fd() < 0;
        loop.stop();
      },
      60 * millisecond);
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(given_up);
  CHECK(loop.now() - begin >= 60 * millisecond);
  CHECK(beats > 0);
  CHECK(sockets.trouble(unresponsive.address) == unresponsive.address + ": no answer within 60 ms");
}

TEST_CASE("a name that takes long to be looked up keeps nothing waiting") {
  ProcessLoop loop(clock_offset_now());
  std::promise<void> answer;
  std::atomic<int> lookups = 0;
  Sockets sockets(
      loop, [&, future = answer.get_future().share()](const std::string& host, const std::string&) {
        ++lookups;
        future.wait();
        return Sockets::Found{std::nullopt, host + " is not known"};
      });
  int beats = 0;
  int given_up = 0;
  loop.every(5 * millisecond, [&] { ++beats; });
  sockets.dial(
      "robot:502",
      [&](const Socket& socket) {
        given_up += socket.fd() < 0 ? 1 : 0;
        CHECK(beats > 0);
        sockets.dial(
            "robot:502",
            [&](const Socket& again) {
              given_up += again.fd() < 0 ? 1 : 0;
              loop.stop();
            },
            20 * second);
        answer.set_value();
      },
      60 * millisecond);
  loop.run();
  CHECK(given_up == 2);
  CHECK(lookups == 1);  // a second thread does not wait for the same name
  CHECK(sockets.trouble("robot:502") == "robot:502: its name: robot is not known");
}

TEST_CASE("names are looked up by the system") {
  ProcessLoop loop(clock_offset_now());
  const std::string port = std::to_string(20000 + (getpid() + 5000) % 10000);
  Socket device;
  bool dialled = false;
  loop.sockets().listen("127.0.0.1:" + port, [&](Socket socket) { device = std::move(socket); });
  loop.sockets().dial("localhost:" + port, [&](const Socket& socket) {
    dialled = socket.fd() >= 0;
    loop.stop();
  });
  loop.after(20 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(dialled);
}
