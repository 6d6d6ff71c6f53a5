// SPDX-License-Identifier: BSD-3-Clause
#include <berth/scan_packet_t.hpp>
#include <berth/scan_request_t.hpp>
#include <fstream>
#include <lcm/lcm-cpp.hpp>

#include "common/bus/simulation.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/playback_adapter.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "test/catch.h"
#include "test/drivers/lidar/lidar_fixture.h"

using namespace berth;
using namespace berth::lidar;
using Catch::Matchers::Contains;

namespace {

struct Directory {
  Directory() {
    std::string name = (std::filesystem::temp_directory_path() / "berth-playback-XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    path = name;
  }
  ~Directory() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

/// An adapter in a loop, and all its messages.
struct PlaybackBench {
  explicit PlaybackBench(LidarDevice device) : adapter(make_adapter(device, ilris(), loop)) {
    adapter->start({[this] { ++readied; }, [this](const Message& message) { take(message); },
                    [this](const std::string& reason) { lost = reason; }});
    simulation.run_for(millisecond);
  }
  void take(const Message& message) {
    if (const auto* answer = std::get_if<ScanAnswer>(&message)) answers.push_back(*answer);
    if (const auto* end = std::get_if<ScanEnd>(&message)) ends.push_back(*end);
    if (const auto* returns = std::get_if<Returns>(&message)) {
      CHECK(returns->device_time + returns->beams.back().after_us <= simulation.now());
      for (const BeamReturn& beam : returns->beams) {
        times.push_back(returns->device_time + beam.after_us);
        beams.push_back(beam);
        windows.push_back(returns->window);
      }
    }
  }
  void order(std::int64_t id, Utime wait) {
    loop.after(0, [this, id] {
      adapter->order({id, {{0, 0, 0.1, 0.1, Pattern::raster, 9, 0, ""}}});
    });
    simulation.run_for(wait);
  }

  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  std::unique_ptr<Adapter> adapter;
  int readied = 0;
  std::string lost;
  std::vector<ScanAnswer> answers;
  std::vector<ScanEnd> ends;
  std::vector<BeamReturn> beams;
  std::vector<Utime> times;
  std::vector<int> windows;
};

LidarDevice files(const std::filesystem::path& path) {
  LidarDevice device;
  device.adapter = LidarDevice::Kind::files;
  device.recording = path;
  return device;
}

template <class Message>
void write_event(lcm::LogFile& log, const char* channel, Utime utime, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  lcm::LogEvent event{};
  event.timestamp = utime;
  event.channel = channel;
  event.datalen = static_cast<int>(bytes.size());
  event.data = bytes.data();
  log.writeEvent(&event);
}

/// Scans of three beams, the first one recorded 20 ms after its request, one every second; the
/// second aborted. In the older type.
void write_log(const std::filesystem::path& path) {
  lcm::LogFile log(path.string(), "w");
  const auto write = [&](const char* channel, Utime utime, const auto& message) {
    write_event(log, channel, utime, message);
  };
  for (int k = 0; k < 3; ++k) {
    const Utime requested_at = 1000 * second + k * second;
    scan_request_t request{};
    request.session = 9;
    request.scan_id = 40 + k;
    write(channels::scan_request, requested_at, request);
    scan_packet_t packet{};
    packet.session = 9;
    packet.scan_id = 40 + k;
    packet.utime = requested_at + 20 * millisecond;
    packet.scan_status = scan_packet_t::RUNNING;
    packet.window = 7;
    packet.count = 3;
    packet.time_us = {0, 500, 1000};
    packet.range_m = {5.0F + static_cast<float>(k), 0, 5.5F};
    packet.azimuth_rad = {0.01F, 0.02F, 0.03F};
    packet.elevation_rad = {-0.01F, 0, 0.01F};
    packet.intensity = {100, 0, 200};
    packet.status = {scan_packet_t::HIT, scan_packet_t::MISS, scan_packet_t::HIT};
    write(channels::scan_data, packet.utime + millisecond, packet);
    scan_packet_t end{};
    end.session = 9;
    end.scan_id = 40 + k;
    end.packet = 1;
    end.scan_status = k == 1 ? scan_packet_t::ABORTED : scan_packet_t::COMPLETE;
    end.reason = k == 1 ? "the fence" : "";
    write(channels::scan_data, packet.utime + 2 * millisecond, end);
    write(channels::scan_data, packet.utime + 900 * millisecond, end);  // as the node repeats it
  }
}

}  // namespace

TEST_CASE(
    "a directory of clouds is played file by file, at the LIDAR's rate when they have no times") {
  Directory directory;
  write_file(directory.path / "b.xyz", "0 0 6\n0.6 0 6\n");
  write_file(directory.path / "a.xyz", "0 0 5\n0.5 0 5\n0 -0.5 5\n");
  write_file(directory.path / "notes.md", "not a cloud");
  PlaybackBench bench(files(directory.path));
  CHECK(bench.readied == 1);
  CHECK(bench.adapter->identity().model == "ILRIS-3D");
  const Utime requested_at = bench.simulation.now();
  bench.order(1, 100 * millisecond);
  REQUIRE(bench.beams.size() == 3);
  CHECK(bench.beams[0].range_m == 5);
  CHECK(double{bench.beams[1].azimuth_rad} == Approx(std::atan(0.1)));
  CHECK(double{bench.beams[2].elevation_rad} == Approx(std::atan(0.1)));
  CHECK(bench.times[0] == requested_at);
  CHECK(bench.times[2] - bench.times[0] == 1000);
  REQUIRE(bench.ends.size() == 1);
  CHECK(bench.ends[0].result == ScanResult::complete);
  CHECK(bench.ends[0].beams == 3);
  bench.order(2, 100 * millisecond);
  CHECK(bench.beams.size() == 5);
  CHECK(bench.beams[3].range_m == 6);

  bench.order(3, 100 * millisecond);
  REQUIRE(bench.answers.size() == 3);
  CHECK_FALSE(bench.answers[2].accepted);
  CHECK_THAT(bench.answers[2].reason, Contains("over after 2 scans"));
  CHECK(bench.lost.empty());
}

TEST_CASE("clouds that cannot be read are refused by name before anything is played") {
  Directory directory;
  write_file(directory.path / "1.xyz", "0 0 5\n");
  write_file(directory.path / "2.xyz", "0 0 five\n");
  write_file(directory.path / "3.pcd", "0 0 5\n");
  Simulation simulation;
  CHECK_THROWS_WITH(make_adapter(files(directory.path), ilris(), simulation.make_loop()),
                    Contains("2.xyz:1: found 'five'") && Contains("3.pcd: "));
}

TEST_CASE("a recording that repeats starts anew; a file gone bad is named and passed over") {
  Directory directory;
  write_file(directory.path / "1.xyz", "0 0 5\n");
  write_file(directory.path / "2.xyz", "0 0 5\n");
  LidarDevice device = files(directory.path);
  device.repeat = true;
  PlaybackBench bench(device);
  write_file(directory.path / "2.xyz", "0 0 five\n");
  for (int id = 1; id <= 3; ++id) bench.order(id, 10 * millisecond);
  REQUIRE(bench.answers.size() == 3);
  CHECK(bench.answers[0].accepted);
  CHECK_THAT(bench.answers[1].reason, Contains("2.xyz:1: "));
  CHECK(bench.answers[2].accepted);
  CHECK(bench.beams.size() == 2);
}

TEST_CASE("times of clouds part their beams and their scans") {
  Directory directory;
  // The second scan 2 s after the first, the third a day later.
  write_file(directory.path / "1.csv", "x,y,z,time\n0,0,5,100.00\n0,0,5,100.25\n");
  write_file(directory.path / "2.csv", "x,y,z,time\n0,0,5,102.00\n0,0,5,102.25\n");
  write_file(directory.path / "3.csv", "x,y,z,time\n0,0,5,86502.5\n");
  LidarDevice device = files(directory.path);
  device.max_gap = 3 * second;
  PlaybackBench bench(device);
  bench.order(1, 500 * millisecond);
  bench.order(2, 5 * second);  // early: it waits for its time
  const Utime requested_at = bench.simulation.now();
  bench.order(3, 5 * second);
  REQUIRE(bench.times.size() == 5);
  CHECK(bench.times[1] - bench.times[0] == 250 * millisecond);
  CHECK(bench.times[2] - bench.times[0] == 2 * second);
  CHECK(bench.times[4] - requested_at == 3 * second);
}

TEST_CASE("a log of today gives back all fields of a beam") {
  Directory directory;
  const auto file = directory.path / "run.lcm";
  {
    lcm::LogFile log(file.string(), "w");
    ScanPacket packet{};
    packet.session = 9;
    packet.scan_id = 40;
    packet.resize(2);
    packet.range_m = {5, 6};
    packet.origin_y_m = {0.1F, -0.1F};
    packet.ambient = {3, 4};
    packet.range_sigma_m = {0.01F, 0};
    packet.range2_m = {0, 9};
    packet.range2_sigma_m = {0, 0.03F};
    packet.intensity2 = {0, 11};
    write_event(log, channels::scan_data, 1000 * second, packet);
  }
  LidarDevice device;
  device.adapter = LidarDevice::Kind::log;
  device.recording = file;
  PlaybackBench bench(device);
  bench.order(1, 100 * millisecond);
  REQUIRE(bench.beams.size() == 2);
  CHECK(bench.beams[0].origin_m[1] == 0.1F);
  CHECK(bench.beams[0].range_sigma_m == 0.01F);
  CHECK(bench.beams[1].ambient == 4);
  CHECK(bench.beams[1].range2_m == 9);
  CHECK(bench.beams[1].range2_sigma_m == 0.03F);
  CHECK(bench.beams[1].intensity2 == 11);
}

TEST_CASE("a log's scans come as they came, and end as they ended") {
  Directory directory;
  write_log(directory.path / "run.lcm");
  LidarDevice device;
  device.adapter = LidarDevice::Kind::log;
  device.recording = directory.path;  // a run directory
  PlaybackBench bench(device);
  const Utime requested_at = bench.simulation.now();
  bench.order(1, 500 * millisecond);
  bench.order(2, 1500 * millisecond);
  bench.order(3, 1500 * millisecond);  // 20 ms late already
  REQUIRE(bench.beams.size() == 9);
  CHECK(bench.times[0] - requested_at == 20 * millisecond);
  CHECK(bench.times[1] - bench.times[0] == 500);
  CHECK(bench.times[3] - bench.times[0] == 1 * second);
  CHECK(bench.beams[3].range_m == 6);
  CHECK(bench.beams[1].status == BeamStatus::miss);
  CHECK(bench.beams[2].intensity == 200);
  CHECK(bench.windows == std::vector<int>(9, 0));  // there is no eighth window in these orders
  REQUIRE(bench.ends.size() == 3);
  CHECK(bench.ends[0].result == ScanResult::complete);
  CHECK(bench.ends[1].result == ScanResult::failed);
  CHECK_THAT(bench.ends[1].reason, Contains("the fence"));
  bench.order(4, 10 * millisecond);
  CHECK_FALSE(bench.answers.back().accepted);
}

TEST_CASE("a played scan can be cancelled; the next order gets the next scan") {
  Directory directory;
  std::string points = "x y z time\n";
  for (int i = 0; i < 200; ++i) points += "0 0 5 " + std::to_string(0.01 * i) + "\n";
  write_file(directory.path / "1.xyz", points);
  write_file(directory.path / "2.xyz", "0 0 7\n");
  PlaybackBench bench(files(directory.path));
  bench.order(1, 600 * millisecond);
  CHECK(bench.beams.size() == 50);
  bench.loop.after(0, [&] { bench.adapter->cancel(1); });
  bench.simulation.run_for(3 * second);
  REQUIRE(bench.ends.size() == 1);
  CHECK(bench.ends[0].result == ScanResult::cancelled);
  CHECK(bench.beams.size() == 50);
  bench.order(2, 100 * millisecond);
  CHECK(bench.beams.back().range_m == 7);
}

TEST_CASE("a source with nothing to play is an error by name") {
  Directory directory;
  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  const auto make = [&](const LidarDevice& device) { make_adapter(device, ilris(), loop); };
  CHECK_THROWS_WITH(make(files(directory.path)), Contains("holds no cloud"));
  CHECK_THROWS_WITH(make(files(directory.path / "none")), Contains("no such"));
  LidarDevice log = files(directory.path);
  log.adapter = LidarDevice::Kind::log;
  CHECK_THROWS_WITH(make(log), Contains("run.lcm: no such log"));
  write_file(directory.path / "run.lcm", "this is no log");
  CHECK_THROWS_WITH(make(log), Contains("holds no scan"));

  // And of the configuration.
  const auto load = [&](const std::string& lidar) {
    std::filesystem::copy("config", directory.path / "config",
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
    std::string text = read_file("config/devices.yaml");
    text = text.substr(0, text.find("\nlidar:") + 1) + lidar;
    write_file(directory.path / "config/devices.yaml", text);
    return load_devices(directory.path / "config").lidar;
  };
  CHECK(load("lidar: {address: 'here:1', model: ilris_3d}\n").adapter == LidarDevice::Kind::tcp);
  CHECK_THROWS_WITH(load("lidar: {adapter: files, model: ilris_3d}\n"), Contains("recording"));
  CHECK_THROWS_WITH(load("lidar: {adapter: ftp, model: ilris_3d}\n"), Contains("adapter"));
  CHECK_THROWS_WITH(load("lidar: {adapter: tcp, model: ilris_3d}\n"), Contains("address"));
  CHECK(load("lidar: {adapter: log, model: ilris_3d, recording: night}\n").recording ==
        directory.path / "config/night");
}
