// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/lidar_node.h"

#include <berth/event_t.hpp>
#include <berth/lidar_state_t.hpp>
#include <cmath>
#include <optional>

#include "common/bus/simulation.h"
#include "drivers/lidar/protocol_adapter.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/drivers/lidar/lidar_fixture.h"
#include "test/drivers/simulated/receiver/wall_scene.h"

using namespace berth;
using Catch::Matchers::Contains;

namespace {

/// The driver, the simulated device on its wire, and a client on the bus.
struct NodeBench {
  explicit NodeBench(bool with_device = true, SimulatedLidarSettings settings = noiseless()) {
    client.subscribe<ScanPacket>(channels::scan_data, Queue::fifo(),
                                 [this](const ScanPacket& p) { packets.push_back(p); });
    client.subscribe<lidar_state_t>(channels::lidar_state, Queue::latest(),
                                    [this](const lidar_state_t& s) { state = s; });
    client.subscribe<event_t>(channels::event, Queue::fifo(),
                              [this](const event_t& e) { events.push_back(e); });
    if (with_device) make_device(std::move(settings));
    LidarNodeConfig config;
    config.profile = ilris();
    lidar::ProtocolSettings link;
    link.address = "lidar:1";
    link.model = "ILRIS-3D";
    SimulatedLoop& loop = simulation.make_loop();
    node = std::make_unique<LidarNode>(NodeSetup{"lidar-driver", 5, "hash"}, config,
                                       std::make_unique<lidar::ProtocolAdapter>(link, loop),
                                       simulation.make_bus(), loop);
    simulation.run_for(1 * second);
  }
  static SimulatedLidarSettings noiseless() {
    SimulatedLidarSettings settings;
    settings.receiver.noise_scale = 0;
    settings.clock_offset = 12500 * millisecond;
    return settings;
  }
  void make_device(SimulatedLidarSettings settings) {
    device.emplace("lidar:1", ilris(), std::move(settings), 1, simulation.make_loop(), scene);
  }

  scan_request_t request(std::int64_t scan_id, int count = 120) {
    scan_request_t r{};
    r.utime = simulation.now();
    r.session = 5;
    r.scan_id = scan_id;
    r.purpose = "test";
    r.window_count = 1;
    scan_window_t window{};
    window.width_rad = 0.1;
    window.height_rad = 0.1;
    window.count = count;
    r.windows = {window};
    return r;
  }
  void send(const scan_request_t& r) { client.publish(channels::scan_request, r); }
  void send_and_wait(const scan_request_t& r, Utime wait = 500 * millisecond) {
    send(r);
    simulation.run_for(wait);
  }
  int events_named(const std::string& code) const {
    int n = 0;
    for (const event_t& e : events) n += e.code == code ? 1 : 0;
    return n;
  }

  Simulation simulation;
  WallScene scene{simulation.now()};
  SimulatedBus& client = simulation.make_bus();
  std::vector<ScanPacket> packets;
  std::vector<event_t> events;
  lidar_state_t state{};
  std::optional<SimulatedLidar> device;
  std::unique_ptr<LidarNode> node;
};

}  // namespace

TEST_CASE("the driver finds its LIDAR and reports its identity") {
  NodeBench bench;
  CHECK(bench.state.state == lidar_state_t::IDLE);
  CHECK(bench.state.model == "ILRIS-3D");
  CHECK(bench.state.serial == "simulated");
  CHECK(bench.state.rate_hz == 2000);
  CHECK(bench.state.clock_offset_s == Approx(12.5).margin(1e-6));
  CHECK(bench.state.clock_offset_sigma_s < 200e-6);
  CHECK(bench.events_named("lidar-connected") == 1);
}

TEST_CASE("a scan of several windows arrives while it runs, in host time, skewed by motion") {
  NodeBench bench;
  bench.scene.speed = 0.5;
  auto r = bench.request(1);
  r.windows.push_back(r.windows[0]);
  r.windows[1].azimuth_rad = 0.1;
  r.windows[1].pattern = scan_window_t::SPIRAL;
  r.windows[1].count = 70;
  r.window_count = 2;
  const Utime requested_at = bench.simulation.now();
  bench.send_and_wait(r, 45 * millisecond);
  REQUIRE(bench.packets.size() == 1);
  CHECK(bench.state.state == lidar_state_t::SCANNING);
  bench.simulation.run_for(500 * millisecond);
  CHECK(bench.state.state == lidar_state_t::IDLE);
  CHECK(bench.state.progress == 1);

  REQUIRE(bench.packets.size() == 6);  // 50 50 20 | 50 20 | end
  int beams = 0;
  for (std::size_t i = 0; i < bench.packets.size(); ++i) {
    const ScanPacket& packet = bench.packets[i];
    CHECK(packet.session == 5);
    CHECK(packet.scan_id == 1);
    CHECK(packet.packet == static_cast<int>(i));
    CHECK(packet.beams_before == beams);
    CHECK(packet.count <= 50);
    CHECK(packet.window == (i < 3 ? 0 : 1));
    CHECK(packet.scan_status == (i < 5 ? ScanPacket::RUNNING : ScanPacket::COMPLETE));
    CHECK(packet.utime > requested_at);
    for (int k = 0; k < packet.count; ++k) {
      const auto at = static_cast<std::size_t>(k);
      REQUIRE(packet.status[at] == ScanPacket::HIT);
      const double depth =
          double{packet.range_m[at]} *
          beam_direction(double{packet.azimuth_rad[at]}, double{packet.elevation_rad[at]}).z();
      const double truth = bench.scene.distance_at(packet.utime + packet.time_us[at]);
      CHECK(depth == Approx(truth).margin(2e-5));  // 0.5 m/s: 40 us of clock mapping at most
    }
    beams += packet.count;
  }
  CHECK(beams == 190);
  CHECK(bench.packets.back().count == 0);
}

TEST_CASE("a repeated request is not scanned again; the end is repeated every second") {
  NodeBench bench;
  bench.send_and_wait(bench.request(1));
  const auto fired = bench.device->beams_fired();
  const auto published = bench.packets.size();
  bench.send_and_wait(bench.request(1), 3 * second);
  CHECK(bench.device->beams_fired() == fired);
  const auto repeats = bench.packets.size() - published;
  CHECK(repeats >= 2);
  CHECK(repeats <= 4);
  const ScanPacket& end = bench.packets[published - 1];
  const ScanPacket& again = bench.packets.back();
  CHECK(again.scan_id == end.scan_id);
  CHECK(again.packet == end.packet);
  CHECK(again.utime == end.utime);
  CHECK(again.scan_status == ScanPacket::COMPLETE);
  CHECK(again.seq > end.seq);
}

TEST_CASE("what the LIDAR cannot do is refused by name, once, and nothing moves") {
  NodeBench bench;
  auto r = bench.request(1);
  r.windows[0].azimuth_rad = radians(19);
  bench.send_and_wait(r);
  REQUIRE(bench.packets.size() == 1);
  CHECK(bench.packets[0].scan_status == ScanPacket::REFUSED);
  CHECK_THAT(bench.packets[0].reason, Contains("window 0: azimuth reaches to"));
  CHECK(bench.device->beams_fired() == 0);
  CHECK(bench.events_named("scan-refused") == 1);
  CHECK(bench.state.state == lidar_state_t::IDLE);
  CHECK(bench.state.progress == 0);
  CHECK_THAT(bench.state.reason, Contains("scan 1: window 0: azimuth reaches to"));
  // The next good one is done.
  bench.send_and_wait(bench.request(2));
  CHECK(bench.state.reason.empty());
  CHECK(bench.packets.back().scan_status == ScanPacket::COMPLETE);
}

TEST_CASE("requests of another session or of the past are not obeyed") {
  NodeBench bench;
  auto foreign = bench.request(1);
  foreign.session = 4;
  bench.send_and_wait(foreign);
  bench.send_and_wait(foreign);
  CHECK(bench.packets.empty());
  CHECK(bench.events_named("foreign-session") == 1);

  bench.send_and_wait(bench.request(8));
  const auto fired = bench.device->beams_fired();
  bench.send_and_wait(bench.request(7));
  CHECK(bench.device->beams_fired() == fired);
  CHECK(bench.events_named("stale-scan-request") == 1);
}

TEST_CASE("cancel ends a scan and is reported") {
  NodeBench bench;
  bench.send_and_wait(bench.request(1, 4000), 200 * millisecond);
  auto r = bench.request(1);
  r.action = scan_request_t::CANCEL;
  bench.send_and_wait(r, 100 * millisecond);
  CHECK(bench.packets.back().scan_status == ScanPacket::ABORTED);
  CHECK(bench.packets.back().reason == "cancelled");
  CHECK(bench.device->beams_fired() < 500);
  CHECK(bench.state.state == lidar_state_t::IDLE);
  CHECK(bench.state.progress < 0.2);
}

TEST_CASE("a newer request takes the place of a running scan") {
  NodeBench bench;
  bench.send_and_wait(bench.request(1, 4000), 200 * millisecond);
  bench.send_and_wait(bench.request(2, 10), 200 * millisecond);
  std::vector<std::pair<std::int64_t, int>> ends;
  for (const ScanPacket& p : bench.packets) {
    if (p.scan_status != ScanPacket::RUNNING) ends.emplace_back(p.scan_id, p.scan_status);
  }
  CHECK(ends == std::vector<std::pair<std::int64_t, int>>{{1, ScanPacket::ABORTED},
                                                          {2, ScanPacket::COMPLETE}});
}

TEST_CASE("a device that falls silent ends the scan, is reported, and is found again") {
  NodeBench bench;
  bench.send_and_wait(bench.request(1, 4000), 200 * millisecond);
  bench.device->faults().silent = true;
  bench.simulation.run_for(2 * second);
  REQUIRE(bench.packets.back().scan_status == ScanPacket::ABORTED);
  CHECK_FALSE(bench.packets.back().reason.empty());
  CHECK(bench.state.state == lidar_state_t::OFFLINE);
  CHECK(bench.events_named("lidar-offline") >= 1);

  bench.send_and_wait(bench.request(2));
  CHECK(bench.packets.back().scan_status == ScanPacket::REFUSED);
  CHECK_THAT(bench.packets.back().reason, Contains("offline"));

  bench.device->faults().silent = false;
  bench.simulation.run_for(3 * second);
  CHECK(bench.state.state == lidar_state_t::IDLE);
  bench.send_and_wait(bench.request(3));
  CHECK(bench.packets.back().scan_status == ScanPacket::COMPLETE);
}

TEST_CASE("a driver that starts before its LIDAR waits for it") {
  NodeBench bench(false);
  bench.simulation.run_for(3 * second);
  CHECK(bench.state.state == lidar_state_t::OFFLINE);
  CHECK_THAT(bench.state.reason, Contains("no answer from lidar:1"));
  CHECK(bench.events_named("lidar-offline") == 1);  // once, not with every dial
  bench.make_device(NodeBench::noiseless());
  bench.simulation.run_for(2 * second);
  CHECK(bench.state.state == lidar_state_t::IDLE);
}

namespace {

/// A device whose messages are set by the test.
struct OddDevice {
  OddDevice(Simulation& simulation,
            std::function<void(lidar::Connection&, const lidar::Message&)> on)
      : loop(simulation.make_loop()), answer(std::move(on)) {
    lidar::listen(loop, "lidar:1", [this](std::unique_ptr<lidar::Connection> accepted) {
      connection = std::move(accepted);
      connection->open([this](const lidar::Message& m) { answer(*connection, m); },
                       [](const std::string&) {});
    });
  }
  SimulatedLoop& loop;
  std::function<void(lidar::Connection&, const lidar::Message&)> answer;
  std::unique_ptr<lidar::Connection> connection;
};

/// Greets and shows its clock as a good device does.
bool behave(Simulation& simulation, lidar::Connection& wire, const lidar::Message& message) {
  if (std::holds_alternative<lidar::Hello>(message)) {
    lidar::Identity identity;
    identity.model = "ILRIS-3D";
    wire.send(identity);
    return true;
  }
  if (const auto* query = std::get_if<lidar::StatusQuery>(&message)) {
    lidar::Status status;
    status.token = query->token;
    status.device_time = simulation.now();
    wire.send(status);
    return true;
  }
  return false;
}

}  // namespace

TEST_CASE("a device of version 1 is greeted in it once it refuses the newest, and is read") {
  const bool complains = GENERATE(true, false);
  NodeBench bench(false);
  std::vector<int> greetings;
  std::unique_ptr<OddDevice> device;
  device = std::make_unique<OddDevice>(
      bench.simulation, [&](lidar::Connection& wire, const lidar::Message& message) {
        if (const auto* hello = std::get_if<lidar::Hello>(&message)) {
          greetings.push_back(hello->version);
          if (hello->version != 1) {
            if (complains) wire.send(lidar::Complaint{"this is version 1 of the protocol"});
            device->loop.after(0, [&] { device->connection.reset(); });
            return;
          }
          lidar::Identity identity;
          identity.version = 1;
          identity.model = "ILRIS-3D";
          return wire.send(identity);
        }
        if (behave(bench.simulation, wire, message)) return;
        if (const auto* order = std::get_if<lidar::ScanOrder>(&message)) {
          wire.send(lidar::ScanAnswer{order->scan_id, true, 1, ""});
          lidar::Returns returns;
          returns.scan_id = order->scan_id;
          returns.device_time = bench.simulation.now();
          returns.beams = {{0, 5, 0.1F, 0, 7, BeamStatus::hit}};
          wire.send(returns);
          wire.send(lidar::ScanEnd{order->scan_id, lidar::ScanResult::complete, 1,
                                   bench.simulation.now(), ""});
        }
      });
  bench.simulation.run_for(2 * second);
  CHECK(greetings == std::vector<int>{2, 1});
  bench.send_and_wait(bench.request(1), 200 * millisecond);
  REQUIRE(bench.packets.size() == 2);
  CHECK(bench.packets[0].range_m == std::vector<float>{5});
  CHECK(bench.packets[0].intensity[0] == 7);
  CHECK(bench.packets[1].scan_status == ScanPacket::COMPLETE);
}

TEST_CASE("all fields of a device's beams are on the bus, in packets of one datagram") {
  NodeBench bench(false);
  OddDevice device(bench.simulation, [&](lidar::Connection& wire, const lidar::Message& message) {
    if (behave(bench.simulation, wire, message)) return;
    if (const auto* order = std::get_if<lidar::ScanOrder>(&message)) {
      wire.send(lidar::ScanAnswer{order->scan_id, true, 1, ""});
      lidar::Returns returns;
      returns.scan_id = order->scan_id;
      returns.device_time = bench.simulation.now();
      returns.beams = {
          {0, 5, 0.1F, -0.1F, 7, BeamStatus::hit, {0.1F, 0.2F, 0.3F}, 1e6F, 0.01F, 6, 0.02F, 5000}};
      wire.send(returns);
    }
  });
  bench.simulation.run_for(2 * second);
  bench.send_and_wait(bench.request(1), 200 * millisecond);
  REQUIRE_FALSE(bench.packets.empty());
  const ScanPacket& packet = bench.packets[0];
  CHECK(packet.origin(0) == Eigen::Vector3f(0.1F, 0.2F, 0.3F).cast<double>());
  CHECK(packet.ambient[0] == 1e6F);
  CHECK(packet.range_sigma_m[0] == 0.01F);
  CHECK(packet.range2_m[0] == 6);
  CHECK(packet.range2_sigma_m[0] == 0.02F);
  CHECK(packet.intensity2[0] == 4095);
  ScanPacket full = packet;
  full.resize(lidar::max_beams_per_message);
  CHECK(full.getEncodedSize() < Bus::max_message_bytes);
}

TEST_CASE("another kind of device is not used") {
  NodeBench bench(false);
  OddDevice device(bench.simulation, [](lidar::Connection& wire, const lidar::Message&) {
    lidar::Identity identity;
    identity.model = "toy";
    wire.send(identity);
  });
  bench.simulation.run_for(2 * second);
  CHECK(bench.state.state == lidar_state_t::OFFLINE);
  CHECK_THAT(bench.state.reason, Contains("'toy', expected 'ILRIS-3D'"));
}

TEST_CASE("a device that answers but never measures ends the scan") {
  NodeBench bench(false);
  OddDevice device(bench.simulation, [&](lidar::Connection& wire, const lidar::Message& message) {
    if (behave(bench.simulation, wire, message)) return;
    if (const auto* order = std::get_if<lidar::ScanOrder>(&message)) {
      wire.send(lidar::ScanAnswer{order->scan_id, true, 100, ""});
    }
  });
  bench.simulation.run_for(2 * second);
  bench.send_and_wait(bench.request(1), 3 * second);
  REQUIRE(bench.packets.size() >= 1);
  CHECK(bench.packets[0].scan_status == ScanPacket::ABORTED);
  CHECK_THAT(bench.packets[0].reason, Contains("no returns of a running scan"));
}

TEST_CASE("returns that do not follow one another, or come from another time, are not used") {
  const auto run = [](std::uint32_t beams_before, Utime clock_step) {
    NodeBench bench(false);
    OddDevice device(bench.simulation, [&](lidar::Connection& wire, const lidar::Message& message) {
      if (behave(bench.simulation, wire, message)) return;
      if (const auto* order = std::get_if<lidar::ScanOrder>(&message)) {
        wire.send(lidar::ScanAnswer{order->scan_id, true, 100, ""});
        lidar::Returns returns;
        returns.scan_id = order->scan_id;
        returns.beams_before = beams_before;
        returns.device_time = bench.simulation.now() + clock_step;
        returns.beams.resize(10);
        wire.send(returns);
      }
    });
    bench.simulation.run_for(2 * second);
    bench.send_and_wait(bench.request(1), 200 * millisecond);
    REQUIRE_FALSE(bench.packets.empty());
    return bench.packets.front();
  };
  CHECK(run(0, 0).count == 10);
  CHECK_THAT(run(3, 0).reason, Contains("do not follow"));
  CHECK_THAT(run(0, second).reason, Contains("make no sense"));
  CHECK_THAT(run(0, -second).reason, Contains("make no sense"));
}

TEST_CASE("large frames of a device are cut to packets of the bus") {
  NodeBench bench(false);
  OddDevice device(bench.simulation, [&](lidar::Connection& wire, const lidar::Message& message) {
    if (behave(bench.simulation, wire, message)) return;
    if (const auto* order = std::get_if<lidar::ScanOrder>(&message)) {
      wire.send(lidar::ScanAnswer{order->scan_id, true, 1200, ""});
      lidar::Returns returns;
      returns.scan_id = order->scan_id;
      returns.device_time = bench.simulation.now();
      returns.beams.resize(lidar::max_beams_per_message);
      for (std::uint32_t i = 0; i < 1200; ++i) returns.beams[i].after_us = i;
      wire.send(returns);
      wire.send(lidar::ScanEnd{order->scan_id, lidar::ScanResult::complete, 1200,
                               bench.simulation.now() + 1200, ""});
    }
  });
  bench.simulation.run_for(2 * second);
  bench.send_and_wait(bench.request(1), 200 * millisecond);
  REQUIRE(bench.packets.size() == 25);
  CHECK(bench.packets[1].utime - bench.packets[0].utime == 50);
  CHECK(bench.packets[24].scan_status == ScanPacket::COMPLETE);
  CHECK(bench.packets[24].beams_before == 1200);
}
