// SPDX-License-Identifier: BSD-3-Clause
// The LIDAR over real TCP: the driver's end and the device's, and peers whose every byte the test
// chooses.
#include "common/bus/process_loop.h"
#include "drivers/lidar/connection.h"
#include "drivers/lidar/protocol_adapter.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "test/catch.h"
#include "test/drivers/lidar/lidar_fixture.h"
#include "test/drivers/lidar/messages.h"
#include "test/drivers/simulated/receiver/wall_scene.h"
#include "test/free_port.h"
#include "test/run_until.h"

using namespace berth;
using namespace berth::lidar;
using Catch::Matchers::Contains;

namespace {

/// One loop with all that is joined over real sockets.
struct TcpBench {
  SimulatedLidar& serve(SimulatedLidarSettings given = {}, LidarProfile profile = ilris()) {
    device.emplace(address, std::move(profile), std::move(given), 1, loop, scene);
    return *device;
  }
  /// A device whose answers, bytes and all, are the test's.
  void serve(std::function<void(TcpConnection&, const Message&)> answer) {
    listen(loop, address, [this, answer](std::unique_ptr<Connection> accepted) {
      odd = std::move(accepted);
      odd->open([this, answer](const Message& m) { answer(dynamic_cast<TcpConnection&>(*odd), m); },
                [this](const std::string& reason) {
                  device_closed = reason;
                  odd.reset();
                });
    });
  }
  ProtocolAdapter& drive(ProtocolSettings link_settings = {}) {
    link_settings.address = address;
    link_settings.model = "ILRIS-3D";
    link = std::make_unique<ProtocolAdapter>(link_settings, loop);
    link->start({[this] { ++readies; },
                 [this](const Message& message) { received.push_back(message); },
                 [this](const std::string& why) { reasons.push_back(why); }});
    return *link;
  }
  template <class Kind>
  std::vector<Kind> all() const {
    return all_of<Kind>(received);
  }
  bool run_until(const std::function<bool()>& done) { return berth::run_until(loop, done); }

  ProcessLoop loop{clock_offset_now()};
  std::string address = free_address();
  WallScene scene{loop.now()};
  std::optional<SimulatedLidar> device;
  std::unique_ptr<Connection> odd;
  std::string device_closed;
  std::unique_ptr<ProtocolAdapter> link;
  int readies = 0;
  std::vector<Message> received;
  std::vector<std::string> reasons;
};

const Window tile{0, 0, 0.1, 0.1, Pattern::raster, 120, 0, ""};

Identity named(std::uint16_t version) {
  Identity identity;
  identity.version = version;
  identity.model = "ILRIS-3D";
  return identity;
}

}  // namespace

TEST_CASE("driver and device speak over real TCP") {
  TcpBench bench;
  LidarProfile profile = ilris();
  profile.rate_hz = 100000;  // a long scan in little time, with frames that fill socket buffers
  SimulatedLidarSettings fast;
  fast.beams_per_packet = static_cast<int>(max_beams_per_message);
  fast.clock_offset = 5 * second;
  bench.serve(fast, profile);
  ProtocolAdapter& link = bench.drive();
  REQUIRE(bench.run_until([&] { return bench.readies == 1; }));
  link.order({1, {{0, 0, 0.1, 0.1, Pattern::raster, 30000, 0, ""}}});
  REQUIRE(bench.run_until([&] { return !bench.all<ScanEnd>().empty(); }));
  std::uint32_t beams = 0;
  for (const Returns& returns : bench.all<Returns>()) {
    CHECK(returns.beams_before == beams);
    beams += static_cast<std::uint32_t>(returns.beams.size());
  }
  CHECK(bench.all<ScanEnd>()[0].result == ScanResult::complete);
  CHECK(beams == 30000);
  CHECK(bench.reasons.empty());
  CHECK(std::abs(seconds(link.clock().offset) - 5) < 1);
}

TEST_CASE("in version 1 a beam comes without what only version 2 has") {
  for (const std::uint16_t version : {1, 2}) {
    TcpBench bench;
    bench.serve();
    std::unique_ptr<Connection> host;
    dial(
        bench.loop, bench.address,
        [&](std::unique_ptr<Connection> connection, const std::string&) {
          host = std::move(connection);
          host->open([&](const Message& message) { bench.received.push_back(message); },
                     [](const std::string&) {});
          host->send(Hello{version});
          host->send(ScanOrder{1, {tile}});
        },
        second);
    REQUIRE(bench.run_until([&] { return !bench.all<ScanEnd>().empty(); }));
    CHECK(bench.all<Identity>()[0].version == version);
    const BeamReturn beam = bench.all<Returns>()[0].beams[0];
    REQUIRE(beam.status == BeamStatus::hit);
    CHECK(beam.range_sigma_m == (version == 1 ? 0 : 0.01F));
  }
}

TEST_CASE("a device that falls silent is given up, dialled again and found") {
  TcpBench bench;
  SimulatedLidar& device = bench.serve();
  ProtocolSettings impatient;
  impatient.status_period = 20 * millisecond;
  impatient.silence = 200 * millisecond;
  impatient.redial = 50 * millisecond;
  bench.drive(impatient);
  REQUIRE(bench.run_until([&] { return bench.readies == 1; }));
  device.faults().silent = true;
  REQUIRE(bench.run_until([&] { return !bench.reasons.empty(); }));
  CHECK_THAT(bench.reasons[0], Contains("nothing received from the LIDAR"));
  device.faults().silent = false;
  CHECK(bench.run_until([&] { return bench.readies == 2; }));
}

TEST_CASE("bytes that are not the protocol's end the connection, and the driver dials anew") {
  TcpBench bench;
  const std::string what = GENERATE("garbage", "damaged", "split", "half and gone");
  int greetings = 0;
  bench.serve([&](TcpConnection& wire, const Message& message) {
    const auto* hello = std::get_if<Hello>(&message);
    if (hello == nullptr) {
      if (const auto* query = std::get_if<StatusQuery>(&message)) {
        wire.send(Status{query->token, bench.loop.now(), DeviceState::idle, 0, 0, ""});
      }
      return;
    }
    // The driver greets a device that hangs up at once in version 1, too.
    std::vector<std::uint8_t> bytes = encode(named(hello->version));
    if (++greetings > 2 || what == "split") {
      for (std::size_t i = 0; i < bytes.size(); ++i) {
        bench.loop.after(static_cast<Utime>(i) * 100, [&bench, byte = bytes[i]] {
          dynamic_cast<TcpConnection&>(*bench.odd).send_bytes({&byte, 1});
        });
      }
      return;
    }
    if (what == "garbage") bytes.assign(100, 0x5a);
    if (what == "damaged") bytes.back() ^= 1;
    if (what == "half and gone") bytes.resize(bytes.size() / 2);
    wire.send_bytes(bytes);
    if (what == "half and gone") bench.loop.after(0, [&bench] { bench.odd.reset(); });
  });
  bench.drive();
  REQUIRE(bench.run_until([&] { return bench.readies == 1; }));
  if (what == "split") {
    CHECK(greetings == 1);
    CHECK(bench.reasons.empty());
  } else {
    CHECK(greetings == 3);
    REQUIRE(bench.reasons.size() == 1);
    CHECK_THAT(bench.reasons[0], Contains(what == "half and gone" ? "closed" : "frame"));
  }
}

TEST_CASE("a device closes the connection of a host that sends what the protocol has not") {
  TcpBench bench;
  bench.serve();
  std::unique_ptr<Connection> host;
  std::string closed;
  dial(
      bench.loop, bench.address,
      [&](std::unique_ptr<Connection> connection, const std::string&) {
        host = std::move(connection);
        host->open([&](const Message& message) { bench.received.push_back(message); },
                   [&](const std::string& reason) { closed = reason; });
        dynamic_cast<TcpConnection&>(*host).send_bytes(std::vector<std::uint8_t>(64, 0x42));
      },
      second);
  REQUIRE(bench.run_until([&] { return !closed.empty(); }));
  REQUIRE(bench.all<Complaint>().size() == 1);
  CHECK_THAT(bench.all<Complaint>()[0].reason, Contains("does not begin with BLDR"));
  bench.drive();  // and serves the next one
  CHECK(bench.run_until([&] { return bench.readies == 1; }));
}
