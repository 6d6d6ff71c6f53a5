// SPDX-License-Identifier: BSD-3-Clause
// The fold: commands and packets in; requests, estimates and states out.
#include "estimator/node/messages.h"
#include "lcmtypes/conversions.h"
#include "test/catch.h"
#include "test/estimator/node/fold_fixture.h"

using namespace berth;
using namespace berth::estimator;
using Command = estimator_command_t;
using State = estimator_state_t;
using Estimate = pose_estimate_t;

namespace {

/// A target as the approach starts: facing the sensor, a little turned.
template <class Message>
std::string encoded(const Message& message) {
  std::string bytes(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Acquires and tracks for some scans.
void acquire_and_track(Loopback& run, int scans) {
  run.lidar.pose = start_pose;
  run.send(command(Command::ACQUIRE, 1, 1));
  for (int i = 0; i < scans; ++i) REQUIRE(run.scan_once());
  REQUIRE(run.estimator.state().mode == State::TRACKING);
}

}  // namespace

TEST_CASE("An idle estimator acquires at once and goes on tracking by itself") {
  Loopback run;
  run.lidar.pose = start_pose;
  REQUIRE(run.output.requests.empty());
  run.send(command(Command::ACQUIRE, 1, 1));
  REQUIRE(run.output.requests.size() == 1);
  CHECK(run.output.requests[0].scan_id == 1);
  CHECK(run.output.requests[0].purpose == "acquire");
  CHECK(run.estimator.state().command_seq == 1);
  CHECK(run.estimator.state().mode == State::ACQUIRING);

  for (int i = 0; i < 5; ++i) REQUIRE(run.scan_once());
  REQUIRE(run.output.estimates.size() == 5);
  CHECK(run.estimator.state().mode == State::TRACKING);
  CHECK(run.output.requests.back().purpose == "track");
  const Estimate& e = run.last();
  CHECK(e.status == Estimate::OK);
  CHECK(e.reason.empty());
  CHECK(e.session == 7);
  CHECK(e.command_seq == 1);
  CHECK(e.scan_id == 5);
  CHECK(e.seq == 5);
  CHECK(e.first_packet == 0);
  CHECK(e.last_packet > 5);
  CHECK(e.packets_missing == 0);
  CHECK(e.target == "radarsat2");
  CHECK(e.target_hash == replica().hash);
  CHECK(e.returns_used > 100);
  CHECK(e.returns_received >= e.returns_used);
  CHECK(e.utime >= e.utime_first_return);
  CHECK(e.utime <= e.utime_last_return);
  CHECK(distance(pose_of(e), start_pose) < 0.01);
  CHECK(angle_between(pose_of(e), start_pose) < radians(1));
}

TEST_CASE("A command for a later scan waits for it") {
  Loopback run;
  acquire_and_track(run, 3);
  const std::int64_t requested = run.estimator.state().scan_id;
  run.send(command(Command::STOP, 2, requested + 2));
  CHECK(run.estimator.state().command_seq == 2);
  REQUIRE(run.scan_once());
  CHECK(run.output.requests.back().scan_id == requested + 1);
  REQUIRE(run.scan_once());
  CHECK(run.estimator.state().mode == State::IDLE);
  CHECK(run.estimator.state().scan_id == requested + 1);
  CHECK_FALSE(run.scan_once());
}

TEST_CASE("A command that comes too late is refused, and obeyed under a new number") {
  Loopback run;
  acquire_and_track(run, 3);
  const std::int64_t requested = run.estimator.state().scan_id;
  run.send(command(Command::STOP, 2, requested));
  CHECK(run.estimator.state().refused_seq == 2);
  CHECK(run.estimator.state().command_seq == 1);
  CHECK_THAT(run.estimator.state().reason, Catch::Contains("late"));
  run.send(command(Command::STOP, 3, requested + 2));
  CHECK(run.estimator.state().command_seq == 3);
}

TEST_CASE("A repeated command changes nothing and brings the answer and the request again") {
  Loopback run;
  run.send(command(Command::ACQUIRE, 1, 1));
  const std::size_t states = run.output.states.size();
  run.send(command(Command::ACQUIRE, 1, 1));
  CHECK(run.output.states.size() == states + 1);
  REQUIRE(run.output.requests.size() == 2);
  CHECK(run.output.requests[1].scan_id == run.output.requests[0].scan_id);
  CHECK(run.output.requests[1].seq == run.output.requests[0].seq + 1);
}

TEST_CASE("The end of a scan already used brings the outstanding request again") {
  Loopback run;
  acquire_and_track(run, 3);
  const std::size_t estimates = run.output.estimates.size();
  const scan_request_t outstanding = run.output.requests.back();
  run.estimator.receive(run.packets.back());
  CHECK(run.output.estimates.size() == estimates);
  CHECK(run.output.requests.back().scan_id == outstanding.scan_id);
  CHECK(run.output.requests.back().seq == outstanding.seq + 1);
}

TEST_CASE("Duplicated and reordered packets give the same estimate") {
  Loopback plain;
  acquire_and_track(plain, 2);
  Loopback shuffled;
  acquire_and_track(shuffled, 2);
  const auto packets = answer(plain.lidar, plain.output.requests.back());
  for (const auto& p : packets) plain.estimator.receive(p);
  // every packet but the last twice, backwards
  for (auto p = packets.rbegin() + 1; p != packets.rend(); ++p) {
    shuffled.estimator.receive(*p);
    shuffled.estimator.receive(*p);
  }
  shuffled.estimator.receive(packets.back());
  CHECK(encoded(shuffled.last()) == encoded(plain.last()));
}

TEST_CASE("Missing packets are counted and the rest is used") {
  Loopback run;
  acquire_and_track(run, 2);
  auto packets = answer(run.lidar, run.output.requests.back());
  REQUIRE(packets.size() > 8);
  packets.erase(packets.begin() + 2, packets.begin() + 5);
  for (const auto& p : packets) run.estimator.receive(p);
  CHECK(run.last().packets_missing == 3);
  CHECK(run.last().status == Estimate::OK);
}

TEST_CASE("A packet of a later scan ends the one whose end was lost") {
  Loopback run;
  acquire_and_track(run, 2);
  const std::int64_t id = run.estimator.state().scan_id;
  auto packets = answer(run.lidar, run.output.requests.back());
  packets.pop_back();
  for (const auto& p : packets) run.estimator.receive(p);
  CHECK(run.output.estimates.size() == 2);
  auto next = packets_of(run.lidar.sweep(full_view(100)), id + 1);
  run.estimator.receive(next.front());
  REQUIRE(run.output.estimates.size() == 3);
  CHECK(run.last().scan_id == id);
  CHECK(run.last().status == Estimate::OK);
}

TEST_CASE("A scan that was never requested is taken while one is awaited") {
  Loopback run;
  acquire_and_track(run, 2);
  scan_request_t request = run.output.requests.back();
  request.scan_id += 10;
  for (const auto& p : answer(run.lidar, request)) run.estimator.receive(p);
  CHECK(run.last().scan_id == request.scan_id);
  CHECK(run.last().status == Estimate::OK);
  CHECK(run.output.requests.back().scan_id == request.scan_id + 1);
}

TEST_CASE("An idle estimator only learns the number of a scan that was not requested") {
  Loopback run;
  for (const auto& p : packets_of(run.lidar.sweep(full_view(100)), 41)) run.estimator.receive(p);
  CHECK(run.output.estimates.empty());
  CHECK(run.estimator.state().scan_id == 41);
  run.send(command(Command::ACQUIRE, 1, 1));
  CHECK(run.output.requests.back().scan_id == 42);
}

TEST_CASE("A procedure's own windows are scanned once") {
  Loopback run;
  run.lidar.pose = start_pose;
  Command scan = command(Command::SCAN, 1, 5);
  scan.windows.resize(1);
  scan.window_count = 1;
  scan.windows[0].width_rad = scan.windows[0].height_rad = 0.1;
  scan.windows[0].count = 100;
  run.send(scan);
  REQUIRE(run.output.requests.size() == 1);
  CHECK(run.output.requests[0].scan_id == 5);
  CHECK(run.output.requests[0].purpose == "procedure");
  REQUIRE(run.scan_once());
  CHECK(run.last().status == Estimate::IDLE);
  CHECK(run.last().returns_received > 0);
  CHECK_FALSE(run.scan_once());
}

TEST_CASE("Empty scans are failures with a reason; three in a row lose the target") {
  Loopback run;
  acquire_and_track(run, 3);
  run.lidar.pose.position.z() = 100;  // gone: every beam misses
  for (int i = 0; i < 3; ++i) {
    REQUIRE(run.scan_once());
    CHECK(run.last().status == Estimate::LOST);
    CHECK_FALSE(run.last().reason.empty());
  }
  CHECK(run.estimator.state().mode == State::ACQUIRING);
  CHECK_THAT(run.estimator.state().reason, Catch::Contains("lost"));
  REQUIRE(run.scan_once());
  CHECK(run.last().status == Estimate::ACQUIRING);
  run.lidar.pose = start_pose;
  for (int i = 0; i < 3; ++i) REQUIRE(run.scan_once());
  CHECK(run.last().status == Estimate::OK);
}

TEST_CASE("Where two scans are not informative enough the next has more beams near the target") {
  EstimatorSetup setup = test_setup();
  setup.options.acquisition_method = "hypotheses";
  setup.options.acquire_beams = 60;  // of the whole field of view, a few of them on the target
  Loopback run(std::move(setup));
  run.lidar.pose = start_pose;
  run.send(command(Command::ACQUIRE, 1, 1));
  const auto beams_per_solid_angle = [&run] {
    double beams = 0, angle = 0;
    for (const scan_window_t& w : run.output.requests.back().windows) {
      beams += w.count;
      angle += w.width_rad * w.height_rad;
    }
    return beams / angle;
  };
  const double at_first = beams_per_solid_angle();
  for (int i = 0; i < 2; ++i) {
    CHECK(beams_per_solid_angle() == Approx(at_first));
    REQUIRE(run.scan_once());
    CHECK(run.last().status != Estimate::OK);
  }
  CHECK(beams_per_solid_angle() > 3 * at_first);
  for (int i = 0; i < 5 && run.last().status != Estimate::OK; ++i) REQUIRE(run.scan_once());
  CHECK(run.last().status == Estimate::OK);
  CHECK(distance(pose_of(run.last()), start_pose) < 0.02);
}

TEST_CASE("Two looks in a row that do not decide are followed by a scan of everything") {
  // Its mark is on the side that is not seen: four poses that are equal but for that.
  Target target;
  target.mesh = make_box({1.5, 1.5, 1});
  target.mesh.append(make_box({0.2, 0.2, 0.12}), {{0.5, 0.5, 0.56}, Quaterniond::Identity()});
  target.name = "marked";
  target.hash = content_hash(target.mesh);
  target.length = 1.5;
  ModelOptions coarse;
  coarse.surface_samples = 6000;
  coarse.grid_voxels = 150000;
  const auto model = compile_target_model(target, coarse);
  EstimatorSetup setup = test_setup();
  setup.target = target.name;
  setup.find_model = [model](const std::string&) { return model; };
  Loopback run(std::move(setup), target.mesh);
  run.lidar.pose = {{0, 0, 5}, rotation_from_vector({0.2, 0.1, 0})};
  run.send(command(Command::ACQUIRE, 1, 1));
  const auto looks = [&run] { return run.output.requests.back().windows.size() > 1; };
  REQUIRE_FALSE(looks());
  for (const bool next : {true, true, false, true}) {
    REQUIRE(run.scan_once());
    CHECK(run.last().status == Estimate::AMBIGUOUS);
    CHECK(looks() == next);
  }
}

TEST_CASE("A jump of the target is never reported as a pose") {
  Loopback run;
  acquire_and_track(run, 4);
  run.lidar.pose = perturbed(run.lidar.pose, (Vector6d() << 0.5, 0.3, 0, 0, 0, 0.8).finished());
  for (int i = 0; i < 8; ++i) {
    REQUIRE(run.scan_once());
    const bool right = distance(pose_of(run.last()), run.lidar.pose) < 0.02;
    CHECK((right || run.last().status != Estimate::OK));
  }
  CHECK(run.last().status == Estimate::OK);
}

TEST_CASE("A refused scan is not requested again before the LIDAR has reported") {
  Loopback run;
  run.send(command(Command::ACQUIRE, 1, 1));
  run.estimator.receive(empty_end(1, ScanPacket::REFUSED, "the laser is off", 1735689601000000));
  REQUIRE(run.output.requests.size() == 1);
  REQUIRE(run.output.estimates.size() == 1);
  CHECK_THAT(run.last().reason, Catch::Contains("the laser is off"));
  CHECK(run.last().covariance[0] > 1e5);  // of no pose at all
  run.estimator.receive(empty_end(1, ScanPacket::REFUSED, "the laser is off", 1735689602000000));
  REQUIRE(run.output.requests.size() == 2);
  CHECK(run.output.requests[1].scan_id == 2);
}

TEST_CASE("Commands that cannot be obeyed are refused with a reason") {
  Loopback run;
  const auto refused = [&](Command c, const std::string& why) {
    run.send(c);
    CHECK(run.estimator.state().refused_seq == c.seq);
    CHECK_THAT(run.estimator.state().reason, Catch::Contains(why));
  };
  refused(command(Command::TRACK, 1, 1), "no pose");
  Command strategy = command(Command::ACQUIRE, 2, 1);
  strategy.strategy = "everywhere";
  refused(strategy, "everywhere");
  Command gate = command(Command::ACQUIRE, 3, 1);
  gate.gate_near_m = 7;
  gate.gate_far_m = 3;
  refused(gate, "gate");
  Command model = command(Command::CHOOSE_MODEL, 4, 1);
  model.target = "sputnik";
  refused(model, "sputnik");
  Command pose = command(Command::TRACK, 5, 1);
  pose.has_initial_pose = true;
  pose.initial_position_m[0] = std::numeric_limits<double>::quiet_NaN();
  refused(pose, "initial pose");
  refused(command(99, 6, 1), "99");
  refused(command(Command::SCAN, 7, 1), "windows");
  CHECK(run.output.requests.empty());
}

TEST_CASE("A target without a long axis is refused by the published acquisition") {
  EstimatorSetup setup = test_setup();
  setup.options.acquisition_method = "voxel_template";
  Loopback run(std::move(setup));
  Command model = command(Command::CHOOSE_MODEL, 1, 1);
  model.target = "cube";
  run.send(model);
  CHECK(run.estimator.state().target == "cube");
  run.send(command(Command::ACQUIRE, 2, 1));
  CHECK(run.estimator.state().refused_seq == 2);
  CHECK_THAT(run.estimator.state().reason, Catch::Contains("elongated"));
}

TEST_CASE("Tracking starts from a given pose") {
  Loopback run;
  run.lidar.pose = start_pose;
  Command track = command(Command::TRACK, 1, 1);
  track.utime = run.lidar.utime;
  track.has_initial_pose = true;
  track.strategy = "edges";
  track.returns_per_scan = 600;
  const Pose given =
      perturbed(start_pose, (Vector6d() << 0.02, -0.02, 0.01, 0.02, 0.01, -0.02).finished());
  set_pose(given, track.initial_position_m, track.initial_q_wxyz);
  run.send(track);
  REQUIRE(run.output.requests.size() == 1);
  int beams = 0;
  for (const auto& w : run.output.requests[0].windows) {
    CHECK(w.name == "edge");
    beams += w.count;
  }
  CHECK(beams > 600);
  for (int i = 0; i < 4; ++i) REQUIRE(run.scan_once());
  CHECK(run.last().returns_received == Approx(600).epsilon(0.25));
  CHECK(run.last().status == Estimate::OK);
  CHECK(distance(pose_of(run.last()), start_pose) < 0.01);
}

TEST_CASE(
    "The same inputs give the same bits, however they are interleaved with the own requests") {
  Loopback first;
  first.lidar.pose = start_pose;
  first.lidar.velocity = {{0.005, 0, -0.02}, {0, 0.01, 0}};
  first.send(command(Command::ACQUIRE, 1, 1));
  for (int i = 0; i < 4; ++i) REQUIRE(first.scan_once());
  const std::int64_t requested = first.estimator.state().scan_id;
  Command track = command(Command::TRACK, 2, requested + 2);
  track.strategy = "sparse";
  first.send(track);
  for (int i = 0; i < 6; ++i) REQUIRE(first.scan_once());

  // A replay: the recorded inputs alone, the requests ignored; the second command a scan earlier.
  RecordedOutput output;
  Estimator replayed(test_setup(), output);
  replayed.receive(command(Command::ACQUIRE, 1, 1));
  bool sent = false;
  for (const auto& p : first.packets) {
    if (!sent && p.scan_id == requested - 1) {
      replayed.receive(track);
      sent = true;
    }
    replayed.receive(p);
  }
  REQUIRE(output.estimates.size() == first.output.estimates.size());
  for (std::size_t i = 0; i < output.estimates.size(); ++i) {
    CHECK(encoded(output.estimates[i]) == encoded(first.output.estimates[i]));
  }
  REQUIRE(output.requests.size() == first.output.requests.size());
  for (std::size_t i = 0; i < output.requests.size(); ++i) {
    // A command that came earlier moves the time of "the last input" of no request but its own.
    CHECK(output.requests[i].windows.size() == first.output.requests[i].windows.size());
    CHECK(output.requests[i].scan_id == first.output.requests[i].scan_id);
  }
}

TEST_CASE("Nonsense on the bus is survived") {
  Loopback run;
  acquire_and_track(run, 2);
  Random random(5, "nonsense");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int round = 0; round < 6; ++round) {
    const std::int64_t id = run.estimator.state().scan_id;
    std::vector<RawBeam> beams(500);
    for (RawBeam& b : beams) {
      b.utime = run.lidar.utime;
      b.azimuth = round == 0 ? nan : random.uniform(-10, 10);
      b.elevation = random.uniform(-10, 10);
      const double ranges[] = {nan, 0, -5, 1e30, 5, std::numeric_limits<double>::infinity()};
      b.range = ranges[round];
      b.status = BeamStatus::hit;
    }
    for (const auto& p : packets_of(beams, id)) run.estimator.receive(p);
    CHECK(run.last().status != Estimate::OK);
    CHECK_FALSE(run.last().reason.empty());
    for (const double c : run.last().covariance) CHECK(std::isfinite(c));
  }
  // arrays shorter than their count
  ScanPacket torn = empty_end(run.estimator.state().scan_id, ScanPacket::COMPLETE, "", 1);
  torn.count = 10;
  run.estimator.receive(torn);
  CHECK(run.output.notes.back() == "bad-packet");
}

TEST_CASE("A beam from next to the sensor's origin counts as one from there to its return") {
  ScanPacket packet{};
  packet.resize(3);
  packet.range_m = {5, 5, 0};
  packet.azimuth_rad = {0.1F, 0.1F, 0.1F};
  packet.status = {ScanPacket::HIT, ScanPacket::HIT, ScanPacket::MISS};
  packet.origin_x_m = {0, 0.5F, 0.5F};
  packet.origin_z_m = {0, -0.25F, 0};
  std::vector<RawBeam> beams;
  append_beams(packet, beams);
  CHECK(beams[0].range == 5);
  CHECK(beams[0].azimuth == double{0.1F});
  const Vector3d point = beams[1].range * beam_direction(beams[1].azimuth, beams[1].elevation);
  CHECK((point - Vector3d(0.5, 0, -0.25) - 5 * beam_direction(double{0.1F}, 0)).norm() < 1e-9);
  CHECK(beams[2].azimuth == double{0.1F});
}

TEST_CASE("A million returns are one scan") {
  Loopback run;
  acquire_and_track(run, 2);
  run.lidar.rate_hz = 1e6;
  scan_request_t request = run.output.requests.back();
  request.windows.resize(1);
  request.windows[0].azimuth_rad = request.windows[0].elevation_rad = 0;
  request.windows[0].width_rad = request.windows[0].height_rad = radians(30);
  request.windows[0].count = 1000000;
  for (const auto& p : answer(run.lidar, request)) run.estimator.receive(p);
  CHECK(run.last().status == Estimate::OK);
  CHECK(distance(pose_of(run.last()), start_pose) < 0.01);
}

TEST_CASE("A moving target is tracked with its velocity") {
  Loopback run;
  run.lidar.pose = start_pose;
  run.send(command(Command::ACQUIRE, 1, 1));
  for (int i = 0; i < 3; ++i) REQUIRE(run.scan_once());
  run.lidar.velocity = {{0, 0, -0.02}, {0, 0, 0}};
  for (int i = 0; i < 25; ++i) {
    REQUIRE(run.scan_once());
    REQUIRE(run.last().status == Estimate::OK);
  }
  const double late = static_cast<double>(run.last().utime - run.lidar.utime) * 1e-6;
  const Pose truth = moved(run.lidar.pose, run.lidar.velocity, late);
  CHECK(distance(pose_of(run.last()), truth) < 0.01);
  CHECK(angle_between(pose_of(run.last()), truth) < radians(1));
  CHECK(run.last().linear_velocity_m_s[2] == Approx(-0.02).margin(0.006));
}
