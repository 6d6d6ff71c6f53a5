// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/lidar/simulated_lidar.h"

#include <array>
#include <cmath>
#include <type_traits>

#include "common/bus/simulation.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/drivers/lidar/lidar_fixture.h"
#include "test/drivers/lidar/messages.h"
#include "test/drivers/simulated/receiver/wall_scene.h"

using namespace berth;
using namespace berth::lidar;

namespace {

/// The device on its wire and a host that keeps all its messages.
struct Bench {
  explicit Bench(SimulatedLidarSettings settings = {}, std::uint64_t seed = 1,
                 LidarProfile profile = ilris())
      : device("lidar:1", std::move(profile), std::move(settings), seed, device_loop, scene) {}

  void connect() {
    dial(
        host_loop, "lidar:1",
        [this](std::unique_ptr<Connection> connection, const std::string&) {
          REQUIRE(connection);
          host = std::move(connection);
          host->open([this](const Message& m) { received.push_back(m); },
                     [this](const std::string& reason) { closed = reason; });
        },
        second);
    simulation.run_for(10 * millisecond);
  }
  /// From an event of the host's loop, as a node would.
  void send(const Message& message) {
    host_loop.after(0, [this, message] { host->send(message); });
  }
  void greet() {
    connect();
    send(Hello{});
    simulation.run_for(10 * millisecond);
  }
  template <class Kind>
  std::vector<Kind> all() const {
    return all_of<Kind>(received);
  }
  std::vector<BeamReturn> beams() const {
    std::vector<BeamReturn> list;
    for (const Returns& returns : all<Returns>()) {
      list.insert(list.end(), returns.beams.begin(), returns.beams.end());
    }
    return list;
  }

  Simulation simulation;
  SimulatedLoop& device_loop = simulation.make_loop();
  SimulatedLoop& host_loop = simulation.make_loop();
  WallScene scene{simulation.now()};
  SimulatedLidar device;
  std::unique_ptr<Connection> host;
  std::vector<Message> received;
  std::string closed;
};

SimulatedLidarSettings perfect() {
  SimulatedLidarSettings settings;
  settings.receiver.noise_scale = 0;
  return settings;
}

const Window small{0, 0, 0.1, 0.1, Pattern::raster, 120, 0, ""};

}  // namespace

TEST_CASE("the device names itself and its limits") {
  Bench bench;
  bench.greet();
  const auto identity = bench.all<Identity>();
  REQUIRE(identity.size() == 1);
  CHECK(identity[0].model == "ILRIS-3D");
  CHECK(identity[0].rate_hz == 2000);
  CHECK(identity[0].field_of_view_rad[0] == Approx(radians(40)));
}

TEST_CASE("a host that does not speak the protocol is notified and left") {
  Bench bench;
  bench.connect();
  SECTION("no greeting") { bench.send(Cancel{1}); }
  SECTION("no version") { bench.send(Hello{0}); }
  bench.simulation.run_for(10 * millisecond);
  CHECK(bench.all<Complaint>().size() == 1);
  CHECK_FALSE(bench.closed.empty());
  // And the next one is served.
  bench.greet();
  CHECK(bench.all<Identity>().size() == 1);
}

TEST_CASE("host and device speak the newest version of both") {
  for (const auto& [host, both] : {std::pair{1, 1}, {2, 2}, {9, 2}}) {
    Bench bench(perfect());
    bench.connect();
    bench.send(Hello{static_cast<std::uint16_t>(host)});
    bench.simulation.run_for(10 * millisecond);
    REQUIRE(bench.all<Identity>().size() == 1);
    CHECK(bench.all<Identity>()[0].version == both);
  }
}

TEST_CASE("a beam over an edge reports both surfaces, one that fails reports none") {
  SimulatedLidarSettings settings = perfect();
  settings.receiver.errors.footprint = true;
  settings.receiver.errors.returns = 2;
  Bench bench(settings);
  bench.scene.wall_behind = 2;
  bench.greet();
  // 1 m aside at 5 m ends the plate.
  const Window edge{std::atan(0.2), 0, 0.004, 0.004, Pattern::raster, 400, 0, ""};
  bench.send(ScanOrder{1, {edge}});
  bench.simulation.run_for(1 * second);
  int both = 0;
  for (const BeamReturn& beam : bench.beams()) {
    if (beam.range2_m == 0) continue;
    ++both;
    CHECK(beam.range_m < 5.2F);
    CHECK(beam.range2_m > 7);
    CHECK(beam.range2_sigma_m == beam.range_sigma_m);
    CHECK(beam.intensity2 > 0);
  }
  CHECK(both > 20);
  bench.received.clear();
  bench.device.faults().blackout = true;
  bench.send(ScanOrder{2, {edge}});
  bench.simulation.run_for(1 * second);
  REQUIRE(bench.beams().size() == 400);
  for (const BeamReturn& beam : bench.beams()) REQUIRE(beam.range2_m == 0);
}

TEST_CASE("a new host takes the place of the old one, and of its scan") {
  Bench bench;
  bench.greet();
  bench.send(ScanOrder{1, {small}});
  bench.simulation.run_for(40 * millisecond);
  auto old = std::move(bench.host);
  bench.greet();
  CHECK_FALSE(bench.closed.empty());
  bench.received.clear();
  bench.simulation.run_for(1 * second);
  CHECK(bench.received.empty());
}

TEST_CASE("beams come at 2000 a second, in packets of one window, while the scan runs") {
  Bench bench(perfect());
  bench.greet();
  const Utime start = bench.simulation.now();
  bench.send(ScanOrder{7, {small, small}});
  bench.simulation.run_for(40 * millisecond);
  CHECK(bench.all<Returns>().size() == 1);  // not all at the end
  bench.simulation.run_for(1 * second);

  const auto answer = bench.all<ScanAnswer>();
  REQUIRE(answer.size() == 1);
  CHECK(answer[0].accepted);
  CHECK(answer[0].beams == 240);
  const auto packets = bench.all<Returns>();
  REQUIRE(packets.size() == 6);  // 50, 50, 20 of each window
  const ScanPattern pattern(small);
  const BeamAngles from = pattern.beam(119);
  const BeamAngles to = pattern.beam(0);
  const double travel = std::hypot(to.azimuth - from.azimuth, to.elevation - from.elevation);
  std::uint32_t beams = 0;
  std::int64_t previous = 0;
  for (const Returns& packet : packets) {
    CHECK(packet.scan_id == 7);
    CHECK(packet.beams_before == beams);
    CHECK(packet.window == (beams < 120 ? 0 : 1));
    for (const BeamReturn& beam : packet.beams) {
      const std::int64_t fired = packet.device_time + beam.after_us;
      // Between the windows the mirror goes back over the window's height: 500 us of settling and
      // 2 sqrt(angle / acceleration).
      if (previous != 0 && beams != 120) CHECK(fired - previous == 500);
      if (beams == 120) CHECK(fired - previous == 500 + slew_time(MirrorSettings{}, travel));
      previous = fired;
      ++beams;
    }
  }
  CHECK(beams == 240);
  const auto end = bench.all<ScanEnd>();
  REQUIRE(end.size() == 1);
  CHECK(end[0].result == ScanResult::complete);
  CHECK(end[0].beams == 240);
  CHECK(bench.simulation.now() - start > 120 * millisecond);
}

TEST_CASE("each beam meets the scene as it was when the beam left") {
  Bench bench(perfect());
  bench.scene.speed = 0.5;  // 30 mm over the scan
  bench.greet();
  bench.send(ScanOrder{1, {small}});
  bench.simulation.run_for(1 * second);
  double first = 0;
  double last = 0;
  for (const Returns& packet : bench.all<Returns>()) {
    for (const BeamReturn& beam : packet.beams) {
      REQUIRE(beam.status == BeamStatus::hit);
      const Utime fired = packet.device_time + beam.after_us;  // this clock has no offset
      const double depth = double{beam.range_m} *
                           beam_direction(double{beam.azimuth_rad}, double{beam.elevation_rad}).z();
      CHECK(depth == Approx(bench.scene.distance_at(fired)).margin(2e-6));
      if (first == 0) first = depth;
      last = depth;
    }
  }
  CHECK(first - last == Approx(0.5 * 119 * 500e-6).margin(1e-5));
}

TEST_CASE("beams without a return and returns from too near are marked") {
  Bench bench(perfect());
  bench.greet();
  SECTION("next to the plate") {
    bench.send(ScanOrder{1, {{0, 0, radians(40), 0, Pattern::raster, 100, 0, ""}}});
    bench.simulation.run_for(1 * second);
    int hits = 0;
    for (const BeamReturn& beam : bench.beams()) {
      const bool on_plate = std::abs(5 * std::tan(double{beam.azimuth_rad})) < 1;
      CHECK(beam.status == (on_plate ? BeamStatus::hit : BeamStatus::miss));
      CHECK((beam.range_m > 0) == on_plate);
      CHECK((beam.intensity > 0) == on_plate);
      hits += on_plate ? 1 : 0;
    }
    CHECK(hits > 40);
    CHECK(hits < 70);
  }
  SECTION("2.9 m away") {
    bench.scene.distance = 2.9;
    bench.send(ScanOrder{1, {{0, 0, 0, 0, Pattern::raster, 10, 0, ""}}});
    bench.simulation.run_for(1 * second);
    REQUIRE(bench.beams().size() == 10);
    for (const BeamReturn& beam : bench.beams()) {
      CHECK(beam.status == BeamStatus::too_near);
      CHECK(beam.range_m == 0);
    }
  }
}

TEST_CASE("noise is the profile's, in range and in both angles") {
  // A plate square to the boresight shows an angle error as range: 5 tan(a) / cos(a) m/rad.
  const double aside = 0.15;
  const double lever = 5 * std::tan(aside) / std::cos(aside);
  LidarProfile profile = ilris();
  Window stare{0, 0, 0, 0, Pattern::raster, 4000, 0, ""};
  double sigma = 0;
  SECTION("range") {
    profile.beam.azimuth_sigma_rad = profile.beam.elevation_sigma_rad = 0;
    sigma = profile.beam.range_sigma_m = 0.02;
  }
  SECTION("azimuth") {
    profile.beam.range_sigma_m = profile.beam.elevation_sigma_rad = 0;
    profile.beam.azimuth_sigma_rad = 1e-3;
    stare.azimuth = aside;
    sigma = 1e-3 * lever;
  }
  SECTION("elevation") {
    profile.beam.range_sigma_m = profile.beam.azimuth_sigma_rad = 0;
    profile.beam.elevation_sigma_rad = 2e-3;
    stare.elevation = aside;
    sigma = 2e-3 * lever;
  }
  Bench bench({}, 1, profile);
  bench.greet();
  bench.send(ScanOrder{1, {stare}});
  bench.simulation.run_for(3 * second);
  const auto beams = bench.beams();
  REQUIRE(beams.size() == 4000);
  double sum = 0;
  double squares = 0;
  for (const BeamReturn& beam : beams) {
    CHECK(double{beam.azimuth_rad} == Approx(stare.azimuth).margin(1e-7));  // as ordered
    const double error = double{beam.range_m} - 5 / std::cos(stare.azimuth + stare.elevation);
    sum += error;
    squares += error * error;
  }
  CHECK(std::abs(sum / 4000) < 4 * sigma / std::sqrt(4000.0));
  CHECK(std::sqrt(squares / 4000) == Approx(sigma).epsilon(0.05));
}

TEST_CASE("weak returns drop out when the device is so set") {
  SimulatedLidarSettings settings = perfect();
  settings.receiver.echoes.full_scale_range_m =
      5;  // the plate, half as bright as white: 2048 on the boresight
  settings.receiver.min_power = 2000.0 / 4095;
  Bench bench(settings);
  bench.greet();
  bench.send(ScanOrder{1, {{0, 0, 0, 0, Pattern::raster, 1, 0, ""}}});
  bench.simulation.run_for(100 * millisecond);
  bench.scene.distance = 5.2;
  bench.send(ScanOrder{2, {{0, 0, 0, 0, Pattern::raster, 1, 0, ""}}});
  bench.simulation.run_for(100 * millisecond);
  const auto beams = bench.beams();
  REQUIRE(beams.size() == 2);
  CHECK(beams[0].intensity == 2048);
  CHECK(beams[1].status == BeamStatus::miss);
}

TEST_CASE("one scan at a time; cancel ends it; orders outside the limits are refused") {
  Bench bench(perfect());
  bench.greet();
  bench.send(ScanOrder{1, {small}});
  bench.simulation.run_for(10 * millisecond);
  bench.send(ScanOrder{2, {small}});
  bench.send(Cancel{5});  // of another: nothing
  bench.simulation.run_for(30 * millisecond);
  bench.send(Cancel{1});
  bench.simulation.run_for(1 * second);
  bench.send(ScanOrder{3, {{1, 0, 0.1, 0.1, Pattern::raster, 10, 0, ""}}});
  bench.simulation.run_for(10 * millisecond);

  const auto answers = bench.all<ScanAnswer>();
  REQUIRE(answers.size() == 3);
  CHECK(answers[0].accepted);
  CHECK(answers[1].reason == "scan 1 is running");
  CHECK_THAT(answers[2].reason, Catch::Matchers::Contains("azimuth"));
  const auto ends = bench.all<ScanEnd>();
  REQUIRE(ends.size() == 1);
  CHECK(ends[0].result == ScanResult::cancelled);
  CHECK(ends[0].beams == 50);
}

TEST_CASE("the device's clock is its own") {
  SimulatedLidarSettings settings = perfect();
  settings.clock_offset = -3 * second;
  settings.clock_drift = 1e-4;
  Bench bench(settings);
  bench.greet();
  const Utime start = bench.simulation.now();
  bench.send(StatusQuery{99});
  bench.simulation.run_for(100 * second);
  bench.send(StatusQuery{100});
  bench.simulation.run_for(1 * second);
  const auto status = bench.all<Status>();
  REQUIRE(status.size() == 2);
  CHECK(status[0].token == 99);
  CHECK(std::abs(status[0].device_time - (start - 3 * second)) < 2 * millisecond);
  CHECK(status[1].device_time - status[0].device_time == 100010000);
}

TEST_CASE("one seed, one noise, whatever the beams meet") {
  const auto ranges = [](std::uint64_t seed, double distance) {
    Bench bench({}, seed);
    bench.scene.distance = distance;
    bench.greet();
    bench.send(ScanOrder{1, {{0, 0, 0, 0, Pattern::raster, 20, 0, ""}}});
    bench.simulation.run_for(1 * second);
    std::vector<float> list;
    for (const BeamReturn& beam : bench.beams()) list.push_back(beam.range_m);
    return list;
  };
  CHECK(ranges(1, 5) == ranges(1, 5));
  CHECK(ranges(1, 5) != ranges(2, 5));
  const auto near = ranges(1, 5);
  const auto far = ranges(1, 6);
  for (std::size_t i = 0; i < near.size(); ++i) CHECK(far[i] - near[i] == Approx(1).margin(1e-5));
}

TEST_CASE("its configuration file is read strictly") {
  const SimulatedLidarSettings settings = load_simulated_lidar("config/simulation_lidar.yaml");
  CHECK(settings.start_delay == 5 * millisecond);
  CHECK(settings.clock_offset == 12500000);
  CHECK(settings.scene.room.reflectivity == 0.6);
  ReceiverSettings receiver;
  read_receiver("config/lidars/short_range.yaml", receiver);
  CHECK(load_lidar_profile("config/lidars/short_range.yaml").beam.pulse_length_m == 0.15);
  CHECK(receiver.range_max_reflectivity == 0.2);
  for (const auto& file : std::filesystem::directory_iterator("config/lidars")) {
    INFO(file.path());
    CHECK_NOTHROW(read_receiver(file.path(), receiver));
    CHECK_NOTHROW(load_lidar_profile(file.path()));
  }
  // The error for a key under its former name gives the present one.
  TemporaryDirectory directory;
  const auto old = directory.path() / "old.yaml";
  write_file(old, read_file("config/simulation_lidar.yaml") + "least_intensity: 10\n");
  CHECK_THROWS_WITH(load_simulated_lidar(old),
                    Contains("least_intensity") && Contains("min_intensity"));
  write_file(old, read_file("config/lidars/short_range.yaml") + "  least_echo: 20 %\n");
  CHECK_THROWS_WITH(load_lidar_profile(old), Contains("least_echo") && Contains("min_echo"));
}

TEST_CASE("faults of the LIDAR: bias, noise, drop-outs, blackout, slowness") {
  Bench bench;
  bench.greet();
  std::int64_t id = 0;
  const auto scan = [&] {
    bench.received.clear();
    bench.send(ScanOrder{++id, {{0, 0, 0, 0, Pattern::raster, 2000, 0, ""}}});
    bench.simulation.run_for(20 * second);
    return bench.beams();
  };
  struct Figures {
    double mean = 0, sigma = 0;
    int hits = 0;
  };
  const auto figures = [](const std::vector<BeamReturn>& beams) {
    Figures f;
    double squares = 0;
    for (const BeamReturn& beam : beams) {
      if (beam.status != BeamStatus::hit) continue;
      ++f.hits;
      f.mean += double{beam.range_m};
      squares += double{beam.range_m} * double{beam.range_m};
    }
    if (f.hits == 0) return f;
    f.mean /= f.hits;
    f.sigma = std::sqrt(squares / f.hits - f.mean * f.mean);
    return f;
  };
  LidarFaults& faults = bench.device.faults();

  const Figures good = figures(scan());
  CHECK(good.hits == 2000);
  faults.range_bias = 0.05;
  CHECK(figures(scan()).mean - good.mean == Approx(0.05).margin(0.002));
  faults = {};
  faults.noise_scale = 3;
  CHECK(figures(scan()).sigma == Approx(3 * good.sigma).epsilon(0.1));
  faults = {};
  faults.range_noise = 2;
  faults.angle_noise = 100;  // square to the boresight: nothing to be seen of it in range
  CHECK(figures(scan()).sigma == Approx(2 * good.sigma).epsilon(0.1));
  faults = {};
  faults.dropout = 0.3;
  CHECK(figures(scan()).hits == Approx(1400).margin(100));
  faults = {};
  faults.blackout = true;
  CHECK(figures(scan()).hits == 0);
  faults = {};
  faults.speed = 0.1;
  const auto slow = scan();
  REQUIRE(slow.size() == 2000);
  CHECK(bench.all<Returns>()[0].beams[1].after_us == 5000);
  faults = {};
  faults.silent = true;
  CHECK(scan().empty());
  faults = {};
  const Figures again = figures(scan());
  CHECK(again.hits == 2000);
  CHECK(again.mean == Approx(5).margin(0.002));
}

TEST_CASE("the lamp behind what is scanned blinds the beams towards it, and only those") {
  Bench bench;
  bench.greet();
  const auto hits_near_axis = [&](double level) {
    bench.scene.sun = {level, Vector3d::UnitZ(), true};
    bench.received.clear();
    bench.send(
        ScanOrder{level > 0 ? 2 : 1, {{0, 0, radians(20), 0, Pattern::raster, 2000, 0, ""}}});
    bench.simulation.run_for(3 * second);
    int near = 0;
    int far = 0;
    int early = 0;
    for (const BeamReturn& beam : bench.beams()) {
      if (beam.status != BeamStatus::hit) continue;
      const double angle = std::abs(double{beam.azimuth_rad});
      near += angle < radians(1) ? 1 : 0;
      far += angle > radians(8) ? 1 : 0;
      early += double{beam.range_m} < 4.9 ? 1 : 0;
    }
    return std::array<int, 3>{near, far, early};
  };
  const auto dark = hits_near_axis(0);
  const auto lit = hits_near_axis(1);
  CHECK(dark[0] == Approx(200).margin(2));
  CHECK(dark[2] == 0);
  CHECK(lit[0] < 100);
  CHECK(lit[1] > 0.97 * dark[1]);
  CHECK(lit[2] > 10);
}

TEST_CASE("at the edge of a plate before a wall ranges are mixed, elsewhere not") {
  // The plate's edges are at 1 m to both sides, 5 m away; the wall is `depth` behind it.
  const auto scan = [](double depth, bool last) {
    SimulatedLidarSettings settings;
    settings.receiver.noise_scale = 0;
    settings.receiver.errors.footprint = true;
    settings.receiver.echoes.last_return = last;
    Bench bench(settings);
    bench.scene.wall_behind = depth;
    bench.greet();
    // A line across the right edge: 1 mm between beams, 60 mm in all.
    const double edge = std::atan(1.0 / 5.0);
    bench.send(ScanOrder{1, {{edge, 0, 0.06 / 5.2, 0, Pattern::raster, 60, 0, ""}}});
    bench.simulation.run_for(1 * second);
    return bench.beams();
  };
  const double half = 0.5 * BeamModel().footprint(5.1);
  const auto place = [](const BeamReturn& beam) {
    return 5 * std::tan(double{beam.azimuth_rad}) - 1;  // from the edge to the beam's middle
  };
  const auto depth_of = [](const BeamReturn& beam) {
    return double{beam.range_m} * std::cos(double{beam.azimuth_rad}) - 5;
  };
  int between = 0;
  const auto blended = scan(0.2, false);
  REQUIRE(blended.size() == 60);
  for (const BeamReturn& beam : blended) {
    REQUIRE(beam.status == BeamStatus::hit);
    const bool mixed = depth_of(beam) > 0.01 && depth_of(beam) < 0.19;
    between += mixed ? 1 : 0;
    if (mixed) CHECK(std::abs(place(beam)) < 1.1 * half);
    if (place(beam) < -1.1 * half) CHECK(depth_of(beam) == Approx(0).margin(1e-3));
    if (place(beam) > 1.1 * half) CHECK(depth_of(beam) == Approx(0.2).margin(1e-3));
  }
  CHECK(between >= 5);

  // Farther apart than a pulse: one or the other, and never between.
  double first_ends = -1;
  double last_begins = 1;
  for (const bool last : {false, true}) {
    for (const BeamReturn& beam : scan(1.0, last)) {
      const double depth = depth_of(beam);
      const bool on_plate = std::abs(depth) < 1e-3;
      CHECK((on_plate || std::abs(depth - 1) < 1e-3));
      if (on_plate && !last) first_ends = std::max(first_ends, place(beam));
      if (!on_plate && last) last_begins = std::min(last_begins, place(beam));
    }
  }
  // The first return widens the plate, the last one narrows it.
  CHECK(first_ends > 0.001);
  CHECK(last_begins < -0.001);
}

TEST_CASE("mirrors that face the beam dazzle; foil that faces away is lost when far") {
  LidarProfile profile = ilris();
  profile.beam.range_max_m = 100;
  SimulatedLidarSettings settings;
  settings.receiver.range_max_reflectivity = 0.2;
  Bench bench(settings, 1, profile);
  bench.greet();
  std::int64_t id = 0;
  const auto shares = [&](const Material& material, double distance, double azimuth) {
    bench.scene.material = material;
    bench.scene.distance = distance;
    bench.scene.half_width = 1000;
    bench.received.clear();
    bench.send(ScanOrder{++id, {{azimuth, 0, 0, 0, Pattern::raster, 500, 0, ""}}});
    bench.simulation.run_for(2 * second);
    std::array<double, 5> share{};
    for (const BeamReturn& beam : bench.beams()) {
      share[static_cast<std::size_t>(beam.status)] += 1.0 / 500;
    }
    return share;
  };
  const auto hit = static_cast<std::size_t>(BeamStatus::hit);
  const auto miss = static_cast<std::size_t>(BeamStatus::miss);
  const auto saturated = static_cast<std::size_t>(BeamStatus::saturated);
  const Material paint{0.5, 0};
  const Material glass{0.05, 0.8, radians(0.7)};
  const Material foil{0.0, 0.6, radians(12)};
  CHECK(shares(paint, 5, 0)[hit] == Approx(1));
  CHECK(shares(glass, 5, 0)[saturated] > 0.8);
  CHECK(shares(glass, 5, radians(10))[hit] == Approx(1));
  const auto sloping = shares(foil, 40, radians(19));  // some mirrors face the beam, some do not
  CHECK(sloping[hit] > 0.05);
  CHECK(sloping[miss] > 0.05);
}
