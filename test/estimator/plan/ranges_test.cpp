// SPDX-License-Identifier: BSD-3-Clause
// The paper's long, medium and short ranges, each by itself and in the fold.
#include <Eigen/Cholesky>

#include "estimator/plan/operating_range.h"
#include "estimator/track/long_range.h"
#include "test/catch.h"
#include "test/estimator/node/fold_fixture.h"

using namespace berth;
using namespace berth::estimator;
using Estimate = pose_estimate_t;

namespace {

LidarProfile rendezvous_lidar() { return load_lidar_profile("config/lidars/rendezvous.yaml"); }

/// A window of so many beams about all of the replica at this range.
Window about(const Pose& pose, int count) {
  const ModelSphere whole{Vector3d::Zero(), 1.1 * replica_model()->radius};
  return *window_around(whole, pose, {}, count, "target");
}

Pose pose_at(double distance, Random& random) {
  return {{0.01 * distance, -0.02 * distance, distance}, random.rotation()};
}

EstimatorSetup rendezvous_setup() {
  EstimatorSetup setup = test_setup();
  setup.lidar = rendezvous_lidar();
  return setup;
}

/// Follows a target that flies towards the sensor; every estimate next to the truth.
struct Flight {
  Loopback run;
  std::vector<Estimate> estimates;
  std::vector<Pose> truths;

  Flight(const Pose& start, const Vector3d& velocity) : run(rendezvous_setup()) {
    run.lidar.beam = rendezvous_lidar().beam;
    run.lidar.rate_hz = rendezvous_lidar().rate_hz;
    run.lidar.pose = start;
    estimator_command_t acquire = command(estimator_command_t::ACQUIRE, 1, 1);
    acquire.gate_near_m = 0.3;
    acquire.gate_far_m = 400;
    run.send(acquire);
    for (int i = 0; i < 8 && run.estimator.state().mode != estimator_state_t::TRACKING; ++i) {
      REQUIRE(run.scan_once());
    }
    INFO(run.last().reason);
    REQUIRE(run.estimator.state().mode == estimator_state_t::TRACKING);
    // From rest, as a chaser would.
    for (int i = 1; i <= 20; ++i) {
      run.lidar.velocity.linear = velocity * i / 20;
      REQUIRE(run.scan_once());
    }
    run.output.estimates.clear();
  }
  void fly_to(double distance) {
    while (run.lidar.pose.position.z() > distance) {
      REQUIRE(run.scan_once());
      estimates.push_back(run.last());
      const double late = static_cast<double>(run.last().utime - run.lidar.utime) * 1e-6;
      truths.push_back(moved(run.lidar.pose, run.lidar.velocity, late));
    }
  }
};

Matrix6d covariance_of(const Estimate& e) {
  Matrix6d m;
  for (int i = 0; i < 36; ++i) m(i / 6, i % 6) = e.covariance[i];
  return m;
}

double position_nees(const Estimate& e, const Pose& truth) {
  const Vector3d error = truth.position - pose_of(e).position;
  const Matrix3d covariance = covariance_of(e).topLeftCorner<3, 3>();
  return error.dot(covariance.ldlt().solve(error)) / 3;
}

}  // namespace

TEST_CASE("Ranges are distinguished by the beams on the target and whether it fits in view") {
  const RangeSwitch ranges(*replica_model(), rendezvous_lidar(), {});
  // 3 m under 0.17 mrad a hundred times; 40 degrees.
  CHECK(ranges.far() == Approx(176).margin(3));
  CHECK(ranges.near() == Approx(4.12).margin(0.1));
  using enum OperatingRange;
  CHECK(ranges.suited(300, medium_range) == long_range);
  CHECK(ranges.suited(50, long_range) == medium_range);
  CHECK(ranges.suited(1, medium_range) == short_range);
}

TEST_CASE("A target that hovers at a boundary does not change ranges to and fro") {
  const RangeSwitch ranges(*replica_model(), rendezvous_lidar(), {});
  for (const double boundary : {ranges.far(), ranges.near()}) {
    for (const OperatingRange start :
         {OperatingRange::long_range, OperatingRange::medium_range, OperatingRange::short_range}) {
      OperatingRange now = ranges.suited(boundary, start);
      for (const double distance : {1.03, 0.97, 1.02, 0.98, 1.0}) {
        CHECK(ranges.suited(boundary * distance, now) == now);
        now = ranges.suited(boundary * distance, now);
      }
    }
  }
}

TEST_CASE("Far away, the position's covariance is consistent, whatever the attitude") {
  const int beams = GENERATE(250, 2500);  // a score of returns, some hundreds
  const BeamModel beam_model = rendezvous_lidar().beam;
  const LongRange long_range(*replica_model(), beam_model, 60);
  Random random(7, "far");
  double nees = 0;
  double worst = 0;
  double sigma = 0;
  constexpr int trials = 60;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(replica().mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.beam = beam_model;
    lidar.pose = pose_at(250, random);
    const Pose truth = lidar.pose;
    const PreprocessedScan scan = preprocess(lidar.sweep(about(truth, beams)), {}, beam_model);
    const LongRangeFix fix = long_range.find(scan);
    REQUIRE(fix.ok);
    CHECK(fix.axis == (fix.used >= 60));
    const Matrix3d covariance = (fix.covariance + fix.systematic).topLeftCorner<3, 3>();
    const Vector3d error = truth.position - fix.pose.position;
    nees += error.dot(covariance.ldlt().solve(error)) / 3 / trials;
    worst = std::max(worst, error.norm());
    sigma += std::sqrt(covariance.trace()) / trials;
  }
  CHECK(nees < 1.3);
  CHECK(nees > 0.15);
  CHECK(worst < 0.2 * replica().length);
  CHECK(sigma < 0.2 * replica().length);
}

TEST_CASE("Some hundred returns determine the long axis, with a consistent covariance") {
  const BeamModel beam_model = rendezvous_lidar().beam;
  const LongRange long_range(*replica_model(), beam_model, 60);
  Random random(8, "axis");
  std::vector<double> off;
  double nees = 0;
  constexpr int trials = 60;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(replica().mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.beam = beam_model;
    lidar.pose = pose_at(250, random);
    const Pose truth = lidar.pose;
    const LongRangeFix fix =
        long_range.find(preprocess(lidar.sweep(about(truth, 2500)), {}, beam_model));
    if (!fix.axis) continue;  // of few returns, seen along the axis
    const double cosine =
        (fix.pose.rotation * Vector3d::UnitX()).dot(truth.rotation * Vector3d::UnitX());
    off.push_back(std::acos(std::min(1.0, std::abs(cosine))));
    const Vector3d error = difference(fix.pose, truth).tail<3>();
    const Matrix3d covariance = fix.systematic.bottomRightCorner<3, 3>();
    nees += error.dot(covariance.ldlt().solve(error)) / 3;
  }
  CHECK(off.size() > 0.9 * trials);
  std::sort(off.begin(), off.end());
  CHECK(off[off.size() / 2] < radians(15));
  CHECK(nees / static_cast<double>(off.size()) < 1.5);
}

TEST_CASE("What little or nothing comes back is not a fix") {
  const LongRange long_range(*replica_model(), rendezvous_lidar().beam, 60);
  CHECK_FALSE(long_range.find({}).ok);
  CHECK_FALSE(long_range.find({}).reason.empty());
  PreprocessedScan one;
  one.points = {{0, 0, 200}};
  one.beam_of_point = {0};
  one.beams.resize(1);
  CHECK_FALSE(long_range.find(one).ok);
  CHECK(long_range.find(one).used == 1);
}

TEST_CASE("The docking interface's window follows it and ends with the field of view") {
  const auto model = replica_model();
  const Pose near{Vector3d(0, 0, 0.5) - model->target.port()->pose.position,
                  Quaterniond::Identity()};
  const RangeOptions ranges;
  const auto region = docking_region(*model, ranges, near);
  REQUIRE(region);
  const auto window = window_around(*region, near, {}, 500, "docking interface");
  REQUIRE(window);
  CHECK(window->width <= radians(40) + 1e-9);
  CHECK(window->count == 500);
  const Pose behind{Vector3d(0, 0, -5), Quaterniond::Identity()};
  CHECK_FALSE(window_around(*region, behind, {}, 500, ""));
  const Pose aside{Vector3d(50, 0, 5), Quaterniond::Identity()};
  CHECK_FALSE(window_around(*region, aside, {}, 500, ""));
  CHECK_FALSE(docking_region(*cube_model(), ranges, near));
}

TEST_CASE("In short range the port that is named is scanned, wherever the sensor is") {
  Target relay;
  relay.mesh = make_box({1, 1, 2});
  relay.name = "relay";
  relay.hash = content_hash(relay.mesh);
  relay.length = 2;
  relay.ports.resize(2);
  relay.ports[0].name = "grapple";
  relay.ports[0].pose.position = {0, 0, -1};
  relay.ports[1].name = "berthing";
  relay.ports[1].pose.position = {0, 0, 1};
  const auto model = coarse_model(relay);
  const Pose pose{{0, 0, 3}, Quaterniond::Identity()};
  RangeOptions ranges;
  CHECK(docking_region(*model, ranges, pose)->centre.z() == -1);
  ranges.docking_port = "berthing";
  CHECK(docking_region(*model, ranges, pose)->centre.z() == 1);
  CHECK_NOTHROW(require_port(relay, ranges));
  ranges.docking_port = "berthign";
  CHECK_THROWS_WITH(require_port(relay, ranges),
                    Catch::Matchers::Contains("'berthign' is not a docking port of target relay, "
                                              "expected one of: grapple berthing"));
}

TEST_CASE("An approach passes from long to medium range without a gap or a jump") {
  Flight flight({{0.5, -0.8, 190}, pose_from_xyzwpr({0, 0, 0, 5, -8, 30}).rotation}, {0, 0, -1.5});
  flight.fly_to(140);
  int ranges[3] = {0, 0, 0};
  double nees = 0;
  for (std::size_t i = 0; i < flight.estimates.size(); ++i) {
    const Estimate& e = flight.estimates[i];
    INFO(flight.truths[i].position.z() << " m: " << e.method << " " << e.reason);
    REQUIRE(e.status == Estimate::OK);
    ++ranges[e.operating_range];
    nees += position_nees(e, flight.truths[i]) / static_cast<double>(flight.estimates.size());
    if (i == 0) continue;
    CHECK(e.operating_range >= flight.estimates[i - 1].operating_range);
    // Errors of neighbours differ by no more than they own to.
    const Vector3d jump =
        (pose_of(e).position - flight.truths[i].position) -
        (pose_of(flight.estimates[i - 1]).position - flight.truths[i - 1].position);
    const double allowed = std::sqrt(
        (covariance_of(e) + covariance_of(flight.estimates[i - 1])).topLeftCorner<3, 3>().trace());
    CHECK(jump.norm() < 4 * allowed);
  }
  CHECK(ranges[Estimate::RANGE_LONG] > 3);
  CHECK(ranges[Estimate::RANGE_MEDIUM] > 10);
  CHECK(nees < 4);  // errors are less than twice what the covariance owns to
  CHECK(angle_between(pose_of(flight.estimates.back()), flight.truths.back()) < radians(5));
}

TEST_CASE("Near the target only its docking interface is scanned") {
  const Vector3d docking = replica().port()->pose.position;
  Flight flight({{-docking.x(), -docking.y(), 5.5}, Quaterniond::Identity()}, {0, 0, -0.1});
  flight.fly_to(3);
  for (std::size_t i = 0; i < flight.estimates.size(); ++i) {
    REQUIRE(flight.estimates[i].status == Estimate::OK);
    CHECK(distance(pose_of(flight.estimates[i]), flight.truths[i]) < 0.03);
  }
  CHECK(flight.estimates.front().operating_range == Estimate::RANGE_MEDIUM);
  CHECK(flight.estimates.back().operating_range == Estimate::RANGE_SHORT);
  REQUIRE(flight.run.output.requests.back().windows.size() == 1);
  CHECK(flight.run.output.requests.back().windows[0].name == "docking interface");
}
