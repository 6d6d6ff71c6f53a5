// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/simulation.h"

#include <unistd.h>

#include <berth/heartbeat_t.hpp>
#include <berth/node_status_t.hpp>

#include "common/bus/node.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "test/catch.h"

using namespace berth;

TEST_CASE("timers fire at their time, in order of time and then of request") {
  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  std::string order;
  loop.after(20, [&] { order += "c"; });
  loop.after(10, [&] { order += "a"; });
  loop.after(10, [&] { order += "b"; });
  const auto cancelled = loop.after(15, [&] { order += "x"; });
  loop.cancel(cancelled);
  const Utime start = simulation.now();
  simulation.run_for(100);
  CHECK(order == "abc");
  CHECK(simulation.now() == start + 100);
}

TEST_CASE("a repeated timer keeps its period and can cancel itself") {
  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  int beats = 0;
  Loop::TimerId timer = 0;
  timer = loop.every(10, [&] {
    if (++beats == 3) loop.cancel(timer);
  });
  simulation.run_for(1000);
  CHECK(beats == 3);
}

TEST_CASE("the id of a timer that has fired does not cancel a later one") {
  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  int fired = 0;
  const auto first = loop.after(10, [&] { ++fired; });
  simulation.run_for(20);
  loop.after(10, [&] { ++fired; });
  loop.cancel(first);
  simulation.run_for(20);
  CHECK(fired == 2);
}

TEST_CASE("a message reaches every subscriber after the sender's compute time") {
  Simulation simulation;
  SimulatedBus& sender = simulation.make_bus(5 * millisecond);
  SimulatedBus& receiver = simulation.make_bus();
  const Utime start = simulation.now();
  std::vector<Utime> arrivals;
  receiver.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(), [&](const heartbeat_t& beat) {
    CHECK(beat.node == "a");
    arrivals.push_back(simulation.now() - start);
  });
  std::size_t recorded = 0;
  simulation.record([&](Utime, const std::string& channel, Bytes) {
    CHECK(channel == channels::heartbeat);
    ++recorded;
  });
  heartbeat_t beat{};
  beat.node = "a";
  sender.publish(channels::heartbeat, beat);
  simulation.run_for(second);
  REQUIRE(arrivals.size() == 1);
  CHECK(arrivals[0] == 5 * millisecond + 100);
  CHECK(recorded == 1);
  CHECK(receiver.counters().received == 1);
  CHECK(sender.counters().published == 1);
}

TEST_CASE("messages of another type, cut short or with a wild length never reach a handler") {
  Simulation simulation;
  SimulatedBus& sender = simulation.make_bus();
  SimulatedBus& receiver = simulation.make_bus();
  int handled = 0;
  receiver.subscribe<ScanPacket>(channels::scan_data, Queue::fifo(),
                                 [&](const ScanPacket&) { ++handled; });
  sender.publish(channels::scan_data, heartbeat_t{});
  simulation.run_for(second);
  CHECK(handled == 0);
  CHECK(receiver.counters().undecodable == 1);
}

TEST_CASE("a message too large for one datagram is a bug of its sender") {
  Simulation simulation;
  SimulatedBus& bus = simulation.make_bus();
  heartbeat_t beat{};
  beat.node.assign(70000, 'x');
  CHECK_THROWS_AS(bus.publish(channels::heartbeat, beat), std::length_error);
}

namespace {

class Probe : public Node {
 public:
  using Node::Node;
  void become_ready() { report(node_status_t::READY, ""); }
  void publish_event(const std::string& text) { event(event_t::INFO, "probe", text); }
  void do_work(Worker::Job job) { work(std::move(job)); }
};

/// What nodes report of themselves.
struct Observer {
  explicit Observer(SimulatedBus& bus) {
    bus.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(),
                               [this](const heartbeat_t&) { ++beats; });
    bus.subscribe<node_status_t>(channels::node_status, Queue::fifo(),
                                 [this](const node_status_t& s) { statuses.push_back(s); });
  }
  int beats = 0;
  std::vector<node_status_t> statuses;
};

}  // namespace

TEST_CASE("a node publishes its state at 1 Hz and on change, and beats at 20 Hz") {
  Simulation simulation;
  Observer observer(simulation.make_bus());
  const int& beats = observer.beats;
  const std::vector<node_status_t>& statuses = observer.statuses;
  Probe node({"probe", 42, "hash"}, simulation.make_bus(), simulation.make_loop());
  simulation.make_loop().after(300 * millisecond, [&] { node.become_ready(); });
  simulation.run_for(2 * second + 10 * millisecond);
  CHECK(beats == 40);
  REQUIRE(statuses.size() == 3);
  CHECK(statuses[0].state == node_status_t::READY);
  CHECK(statuses[0].session == 42);
  CHECK(statuses[0].configuration_hash == "hash");
  CHECK_FALSE(statuses[0].version.empty());
}

TEST_CASE("a stopped node receives waiting messages when it goes on, a killed one none") {
  Simulation simulation;
  SimulatedBus& subscriber = simulation.make_bus();
  int beats = 0;
  subscriber.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(),
                                    [&](const heartbeat_t&) { ++beats; });
  SimulatedBus& bus = simulation.make_bus();
  SimulatedLoop& loop = simulation.make_loop();
  auto node = std::make_unique<Probe>(NodeSetup{"probe", 42, ""}, bus, loop);
  int received = 0;
  bool fired = false;
  bus.subscribe<node_status_t>(channels::node_status, Queue::fifo(),
                               [&](const node_status_t&) { ++received; });
  simulation.stop(loop, bus);
  loop.after(100 * millisecond, [&] { fired = true; });
  subscriber.publish(channels::node_status, node_status_t{});
  simulation.run_for(second);
  CHECK(beats == 0);
  CHECK(received == 0);
  CHECK_FALSE(fired);
  simulation.go_on(loop, bus);
  simulation.run_for(210 * millisecond);
  CHECK(received == 1);
  CHECK(fired);
  CHECK(beats == 4);
  simulation.kill(loop, bus);
  node.reset();
  subscriber.publish(channels::node_status, node_status_t{});
  simulation.run_for(second);
  CHECK(received == 1);
  CHECK(beats == 4);
}

TEST_CASE("texts of others, however long, fit into an event and a status") {
  Simulation simulation;
  SimulatedBus& subscriber = simulation.make_bus();
  std::string event_text;
  subscriber.subscribe<event_t>(channels::event, Queue::fifo(),
                                [&](const event_t& e) { event_text = e.text; });
  Probe node({"probe", 42, ""}, simulation.make_bus(), simulation.make_loop());
  node.publish_event(std::string(70000, 'x'));
  simulation.run_for(millisecond);
  CHECK(event_text == std::string(2000, 'x'));
}

TEST_CASE("work is done at once, unless it is stopped: then the node is in FAULT, and beats") {
  Simulation simulation;
  Observer observer(simulation.make_bus());
  const int& beats = observer.beats;
  const std::vector<node_status_t>& statuses = observer.statuses;
  SimulatedLoop& loop = simulation.make_loop();
  Probe node({"probe", 42, ""}, simulation.make_bus(), loop);
  node.become_ready();
  std::string done;
  const auto job = [&](const std::string& name) {
    node.do_work(
        {name, 300 * millisecond, [&done, name] { done += name; }, [&done] { done += "."; }});
  };
  job("a");
  CHECK(done == "a.");
  simulation.stop_work(loop);
  job("b");
  job("c");
  simulation.run_for(290 * millisecond);
  CHECK(statuses.back().state == node_status_t::READY);
  simulation.run_for(70 * millisecond);
  CHECK(statuses.back().state == node_status_t::FAULT);
  CHECK(statuses.back().reason == "b takes longer than its budget of 0.3 s");
  CHECK(done == "a.");
  CHECK(beats == 7);
  simulation.go_on_with_work(loop);
  simulation.run_for(50 * millisecond);
  CHECK(done == "a.b.c.");
  CHECK(statuses.back().state == node_status_t::READY);
}

TEST_CASE("packets are lost for each receiver by itself, in the requested share") {
  Simulation simulation;
  SimulatedBus& sender = simulation.make_bus();
  int received[2] = {0, 0};
  int both = 0;
  bool first = false;
  simulation.make_bus().subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(),
                                               [&](const heartbeat_t&) {
                                                 ++received[0];
                                                 first = true;
                                               });
  simulation.make_bus().subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(),
                                               [&](const heartbeat_t&) {
                                                 ++received[1];
                                                 both += first ? 1 : 0;
                                               });
  simulation.set_bus_loss(0.2);
  for (int i = 0; i < 10000; ++i) {
    first = false;
    sender.publish(channels::heartbeat, heartbeat_t{});
    simulation.run_for(millisecond);
  }
  CHECK(received[0] == Approx(8000).margin(200));  // five sigma
  CHECK(received[1] == Approx(8000).margin(200));
  CHECK(both == Approx(6400).margin(250));
}
