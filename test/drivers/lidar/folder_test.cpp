// SPDX-License-Identifier: BSD-3-Clause
// A watched folder with real files: the adapter alone, and behind the driver's node.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <berth/event_t.hpp>
#include <berth/scan_request_t.hpp>
#include <fstream>

#include "common/bus/process_loop.h"
#include "common/bus/simulation.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/folder_adapter.h"
#include "drivers/lidar/lidar_node.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/drivers/lidar/lidar_fixture.h"
#include "test/drivers/lidar/messages.h"
#include "test/run_until.h"

using namespace berth;
using namespace berth::lidar;
using Catch::Matchers::Contains;

namespace {

const char* three_points = "0 0 5\n0.5 0 5\n0 -0.5 5\n";

struct FolderBench {
  FolderBench() {
    adapter.start({[this] { ++readied; },
                   [this](const Message& message) { received.push_back(message); },
                   [this](const std::string& reason) { lost.push_back(reason); },
                   [this](const std::string& what) { errors.push_back(what); }});
    REQUIRE(run_until([this] { return readied == 1; }));
  }
  void order(std::int64_t id) {
    adapter.order({id, {{0, 0, 0.1, 0.1, Pattern::raster, 9, 0, ""}}});
    REQUIRE(run_until([this] { return !all<ScanAnswer>().empty(); }));
  }
  bool run_until(const std::function<bool()>& done) { return berth::run_until(loop, done); }
  bool ended() {
    const bool in_time = run_until([this] { return !all<ScanEnd>().empty(); });
    for (const std::string& error : errors) UNSCOPED_INFO(error);
    return in_time;
  }
  bool has_errors(std::size_t n) {
    return run_until([&] { return errors.size() == n; });
  }
  template <class Kind>
  std::vector<Kind> all() const {
    return all_of<Kind>(received);
  }
  std::size_t beams() const {
    std::size_t n = 0;
    for (const Returns& returns : all<Returns>()) n += returns.beams.size();
    return n;
  }

  TemporaryDirectory directory;
  std::filesystem::path folder = directory.path();
  ProcessLoop loop{clock_offset_now()};
  FolderAdapter adapter{folder, {}, ilris(), loop};
  int readied = 0;
  std::vector<Message> received;
  std::vector<std::string> lost;
  std::vector<std::string> errors;
};

Utime now_of(FolderBench& bench) { return bench.loop.now() + bench.adapter.clock().offset; }

}  // namespace

TEST_CASE("the file that is written into the folder after an order is its scan") {
  FolderBench bench;
  bench.order(7);
  CHECK(bench.all<ScanAnswer>()[0].accepted);
  write_file(bench.folder / "scan.xyz", three_points);
  REQUIRE(bench.ended());
  const Utime ended = now_of(bench);
  REQUIRE(bench.beams() == 3);
  const Returns returns = bench.all<Returns>()[0];
  CHECK(returns.scan_id == 7);
  CHECK(returns.beams[0].range_m == 5);
  CHECK(returns.beams[1].azimuth_rad == Approx(std::atan(0.1)));
  // The last beam is as old as the file's last change, those before at the LIDAR's rate.
  CHECK(returns.beams[2].after_us == 1000);
  struct stat file {};
  REQUIRE(stat((bench.folder / "scan.xyz").c_str(), &file) == 0);
  CHECK(returns.device_time + 1000 == file.st_mtim.tv_sec * second + file.st_mtim.tv_nsec / 1000);
  CHECK(returns.device_time + 1000 <= ended);
  CHECK(bench.all<ScanEnd>()[0].result == ScanResult::complete);
  CHECK(bench.all<ScanEnd>()[0].beams == 3);
  CHECK(bench.errors.empty());
}

TEST_CASE("a file is taken once it is closed or renamed into the folder, not before") {
  FolderBench bench;
  bench.order(1);
  bool wait_over = false;
  SECTION("closed") {
    std::ofstream file(bench.folder / "scan.xyz");
    file << "0 0 5\n0.5 0 5\n" << std::flush;
    bench.loop.after(100 * millisecond, [&] { wait_over = true; });
    REQUIRE(bench.run_until([&] { return wait_over; }));
    CHECK(bench.beams() == 0);
    file << "0 -0.5 5\n";
    file.close();
  }
  SECTION("renamed") {
    // Another folder of the same file system, as an export into a scratch folder is moved.
    const TemporaryDirectory scratch;
    write_file(scratch.path() / "scan.xyz", three_points);
    bench.loop.after(100 * millisecond, [&] { wait_over = true; });
    REQUIRE(bench.run_until([&] { return wait_over; }));
    CHECK(bench.beams() == 0);
    std::filesystem::rename(scratch.path() / "scan.xyz", bench.folder / "scan.xyz");
  }
  REQUIRE(bench.ended());
  CHECK(bench.beams() == 3);
  CHECK(bench.errors.empty());
}

TEST_CASE("a bad file is reported by name and line, and the next good one is the scan") {
  FolderBench bench;
  bench.order(1);
  // A PLY declares its number of vertices: a half written one is recognised.
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n0 0 5\n";
  write_file(bench.folder / "half.ply", head);
  REQUIRE(bench.has_errors(1));
  CHECK_THAT(bench.errors[0], Contains("half.ply") && Contains("not used"));
  write_file(bench.folder / "bad.xyz", "0 0 5\n0 zero 5\n");
  REQUIRE(bench.has_errors(2));
  CHECK_THAT(bench.errors[1], Contains("bad.xyz:2"));
  write_file(bench.folder / "notes.md", "not a cloud");
  CHECK(bench.all<ScanEnd>().empty());
  CHECK(bench.adapter.ready());
  // Closed again once it is whole, it is taken.
  std::ofstream(bench.folder / "half.ply", std::ios::app) << "0.5 0 5\n";
  REQUIRE(bench.ended());
  CHECK(bench.beams() == 2);
  CHECK(bench.errors.size() == 2);
}

TEST_CASE("a file without an order, and a scan from before its order, are reported and not used") {
  FolderBench bench;
  write_file(bench.folder / "early.xyz", three_points);
  REQUIRE(bench.has_errors(1));
  CHECK_THAT(bench.errors[0], Contains("early.xyz: came while no scan was waited for"));
  bench.order(1);
  write_file(bench.folder / "20260102T030405.5Z.xyz", three_points);
  REQUIRE(bench.has_errors(2));
  CHECK_THAT(bench.errors[1], Contains("by its name its scan began"));
  CHECK(bench.beams() == 0);
}

TEST_CASE("a scan's time is that of its beams, of its name, or of the file's last change") {
  const auto scan = [](const std::string& name, bool timed, Utime first) {
    RecordedScan made;
    made.name = name;
    made.timed = timed;
    for (const Utime after : {0, 500, 900}) made.beams.push_back({first + after, 0, {}});
    return made;
  };
  const Utime changed = 1790000000LL * second;
  const Utime named = 1767323045LL * second + 250 * millisecond;  // 2026-01-02T03:04:05.25Z
  auto made = scan("ilris_20260102T030405.25Z_2.pcd", true, 1770000000LL * second);
  CHECK(state_time(made, changed).first == 1770000000LL * second);
  made = scan("ilris_20260102T030405.25Z_2.pcd", true, 40 * second);  // since it was switched on
  CHECK(state_time(made, changed).first == named);
  CHECK(made.beams[2].utime == named + 900);
  made = scan("ilris_20260102T030405.25Z_2.pcd", false, 0);
  CHECK(state_time(made, changed).first == named);
  made = scan("ilris_20261302T030405Z.pcd", false, 0);  // no such month
  CHECK(state_time(made, changed).source == "its last change");
  CHECK(made.beams[2].utime == changed);
}

TEST_CASE("cancel ends the waiting; a folder that goes is lost and found again") {
  FolderBench bench;
  bench.order(3);
  bench.adapter.cancel(3);
  REQUIRE(bench.ended());
  CHECK(bench.all<ScanEnd>()[0].result == ScanResult::cancelled);
  std::filesystem::remove_all(bench.folder);
  REQUIRE(bench.run_until([&] { return !bench.lost.empty(); }));
  CHECK_FALSE(bench.adapter.ready());
  CHECK_THAT(bench.lost[0], Contains("the folder is gone"));
  std::filesystem::create_directory(bench.folder);
  REQUIRE(bench.run_until([&] { return bench.readied == 2; }));
  bench.received.clear();
  bench.order(4);
  write_file(bench.folder / "scan.xyz", three_points);
  REQUIRE(bench.ended());
  CHECK(bench.beams() == 3);
}

TEST_CASE("the driver's node publishes an exported scan as any, and a bad file as an event") {
  const TemporaryDirectory directory;
  ProcessLoop loop(clock_offset_now());
  /// Hands messages on at once, within one loop.
  struct LocalBus final : Bus {
    void send(const std::string& channel, Bytes bytes) override {
      const std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
      for (const RawHandler& handler : handlers[channel]) handler(copy);
    }
    void receive(const std::string& channel, Queue, RawHandler handler) override {
      handlers[channel].push_back(std::move(handler));
    }
    std::map<std::string, std::vector<RawHandler>> handlers;
  } bus;
  std::vector<ScanPacket> packets;
  std::vector<std::string> events;
  bus.subscribe<ScanPacket>(channels::scan_data, Queue::fifo(),
                            [&](const ScanPacket& packet) { packets.push_back(packet); });
  bus.subscribe<event_t>(channels::event, Queue::fifo(),
                         [&](const event_t& event) { events.push_back(event.code); });
  LidarDevice device;
  device.adapter = LidarDevice::Kind::folder;
  device.recording = directory.path();
  LidarNodeConfig config;
  config.profile = ilris();
  LidarNode node({"lidar-driver", 5, "hash"}, config, make_adapter(device, ilris(), loop), bus,
                 loop);
  loop.after(50 * millisecond, [&] {
    scan_request_t request{};
    request.session = 5;
    request.scan_id = 1;
    request.window_count = 1;
    request.windows.resize(1);
    request.windows[0].width_rad = request.windows[0].height_rad = 0.1;
    request.windows[0].count = 9;
    bus.publish(channels::scan_request, request);
  });
  loop.after(100 * millisecond,
             [&] { write_file(directory.path() / "bad.xyz", "0 0 five\n0 0 5\n0 zero 5\n"); });
  loop.after(200 * millisecond, [&] {
    std::string points;
    for (int i = 0; i < 120; ++i) points += "0 0." + std::to_string(100 + i) + " 5\n";
    write_file(directory.path() / "good.xyz", points);
  });
  const auto beat = loop.every(millisecond, [&] {
    if (!packets.empty() && packets.back().scan_status != ScanPacket::RUNNING) loop.stop();
  });
  loop.after(10 * second, [&] { loop.stop(); });
  loop.run();
  loop.cancel(beat);
  REQUIRE(packets.size() == 4);  // 50 50 20 | end
  CHECK(packets[1].beams_before == 50);
  CHECK(packets[3].scan_status == ScanPacket::COMPLETE);
  CHECK(packets[3].beams_before == 120);
  CHECK(std::count(events.begin(), events.end(), "lidar-trouble") == 1);
}

TEST_CASE("a folder that is none, and the twin, are refused") {
  ProcessLoop loop(clock_offset_now());
  LidarDevice device;
  device.adapter = LidarDevice::Kind::folder;
  device.recording = "/nowhere/at/all";
  CHECK_THROWS_WITH(make_adapter(device, ilris(), loop), Contains("no such folder"));
  Simulation simulation;
  CHECK_THROWS_WITH(make_adapter(device, ilris(), simulation.make_loop()), Contains("twin"));
}
