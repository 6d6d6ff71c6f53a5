// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "common/core/statistics.h"
#include "estimator/plan/scan_planner.h"
#include "estimator/published/icp.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

struct Trials {
  std::vector<double> error_m;
  std::vector<double> error_rad;
  double nees = 0;  // mean normalised error squared over six
  int ok = 0;
};

Trials run_trials(const IcpTrackingOptions& options, ScanStrategy strategy, int count,
                  double start_m, double start_rad) {
  const auto model = replica_model();
  const PlannerOptions planner_options;
  const ScanPlanner planner(*model, {}, planner_options);
  const IcpTracking tracking(*model, nominal_beam, options);
  Random random(2, "tracking");
  Trials trials;
  for (int i = 0; i < count; ++i) {
    ScanMaker lidar(model->target.mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.pose = displaced(paper_pose, random, 0.1, radians(15));
    const Pose truth = lidar.pose;
    const Pose start = displaced(truth, random, start_m, start_rad);
    const auto raw = lidar.sweep(planner.plan(start, start_m, strategy, 1000));
    const TrackingResult result =
        tracking.track(preprocess(raw, {}, nominal_beam), {start, prior(start_m, start_rad), {}});
    const Vector6d error = difference(result.pose, truth);
    trials.error_m.push_back(error.head<3>().norm());
    trials.error_rad.push_back(error.tail<3>().norm());
    trials.nees += error.dot(result.covariance.ldlt().solve(error)) / 6 / count;
    trials.ok += result.ok ? 1 : 0;
  }
  return trials;
}

}  // namespace

TEST_CASE("Tracking converges from 30 mm and 2 degrees with every registration and strategy") {
  const auto registration = GENERATE(Registration::point_to_point, Registration::point_to_plane);
  const auto strategy = GENERATE(ScanStrategy::sparse, ScanStrategy::corners, ScanStrategy::edges,
                                 ScanStrategy::corners_sparse, ScanStrategy::edges_sparse);
  IcpTrackingOptions options;
  options.icp.registration = registration;
  const Trials trials = run_trials(options, strategy, 25, 0.03, radians(2));
  CHECK(trials.ok == 25);
  CHECK(upper_median(trials.error_m) < 0.005);
  CHECK(upper_median(trials.error_rad) < radians(0.4));
  for (const double e : trials.error_m) CHECK(e < 0.015);
  for (const double e : trials.error_rad) CHECK(e < radians(1));
}

TEST_CASE("Tracking converges from 100 mm and 5 degrees") {
  const Trials trials = run_trials({}, ScanStrategy::corners_sparse, 25, 0.1, radians(5));
  for (const double e : trials.error_m) CHECK(e < 0.015);
  for (const double e : trials.error_rad) CHECK(e < radians(1));
}

TEST_CASE("Stored closest points are coarser than refined ones, and still good to a centimetre") {
  IcpTrackingOptions stored;
  stored.icp.refine_closest_points = false;
  const Trials coarse = run_trials(stored, ScanStrategy::corners_sparse, 25, 0.03, radians(2));
  const Trials fine = run_trials({}, ScanStrategy::corners_sparse, 25, 0.03, radians(2));
  CHECK(upper_median(coarse.error_m) < 0.01);
  CHECK(upper_median(fine.error_m) < upper_median(coarse.error_m));
}

TEST_CASE("The covariance is consistent with the errors") {
  const Trials trials = run_trials({}, ScanStrategy::corners_sparse, 100, 0.03, radians(2));
  // A mean over 100 trials; somewhat below 1 is cautious, above it is not honest.
  CHECK(trials.nees > 0.4);
  CHECK(trials.nees < 1.2);
}

TEST_CASE("The covariance is symmetric, positive, and grows with the noise") {
  const auto model = replica_model();
  const IcpTrackingOptions options;
  const IcpTracking tracking(*model, nominal_beam, options);
  double trace[2] = {0, 0};
  for (const int noisy : {0, 1}) {
    ScanMaker lidar(model->target.mesh);
    lidar.beam.range_sigma_m = noisy != 0 ? 0.02 : 0.01;
    lidar.pose = paper_pose;
    const auto raw = lidar.sweep(around(*model, paper_pose, 4000));
    const TrackingResult result = tracking.track(preprocess(raw, {}, nominal_beam),
                                                 {paper_pose, prior(0.03, radians(2)), {}});
    REQUIRE(result.ok);
    CHECK(result.covariance == result.covariance.transpose());
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(result.covariance);
    CHECK(eigen.eigenvalues()[0] > 0);
    trace[noisy] = result.covariance.trace();
  }
  CHECK(trace[1] > 1.5 * trace[0]);
}

TEST_CASE("A moving target is measured where it was at the scan's mean time") {
  const auto model = replica_model();
  const IcpTrackingOptions options;
  const IcpTracking tracking(*model, nominal_beam, options);
  ScanMaker lidar(model->target.mesh);
  lidar.pose = paper_pose;
  lidar.velocity = {{0.03, 0, -0.05}, {0, 0, 0.05}};
  const Pose at_start = lidar.pose;
  const std::int64_t start = lidar.utime;
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 4000)), {}, nominal_beam);
  const Pose truth =
      moved(at_start, lidar.velocity, static_cast<double>(scan.utime_mean - start) * 1e-6);
  const TrackingResult result =
      tracking.track(scan, {truth, prior(0.03, radians(2)), lidar.velocity});
  REQUIRE(result.ok);
  CHECK(distance(result.pose, truth) < 0.005);
  CHECK(angle_between(result.pose, truth) < radians(0.3));

  IcpTrackingOptions skewed = options;
  skewed.deskew = false;
  const TrackingResult worse = IcpTracking(*model, nominal_beam, skewed)
                                   .track(scan, {truth, prior(0.03, radians(2)), lidar.velocity});
  CHECK(difference(worse.pose, truth).norm() > difference(result.pose, truth).norm());
}

TEST_CASE("An arm behind the target and strays in front do not disturb") {
  const auto model = replica_model();
  const IcpTrackingOptions options;
  const IcpTracking tracking(*model, nominal_beam, options);
  ScanMaker lidar(model->target.mesh);
  lidar.pose = paper_pose;
  Mesh arm;
  arm.append(make_cylinder(0.15, 2, 12), {{0.1, -0.2, 9.3}, Quaterniond::Identity()});
  lidar.add_clutter(arm);
  auto raw = lidar.sweep(around(*model, paper_pose, 4000));
  Random random(1, "strays");
  for (RawBeam& b : raw) {
    if (random.uniform() < 0.1 && b.status == BeamStatus::hit) b.range = random.uniform(4, 12);
  }
  Random start_random(1, "start");
  const TrackingResult result =
      tracking.track(preprocess(raw, {}, nominal_beam),
                     {displaced(paper_pose, start_random, 0.03, 0.03), prior(0.03, 0.03), {}});
  REQUIRE(result.ok);
  CHECK(distance(result.pose, paper_pose) < 0.008);
}

TEST_CASE("A pose that the scan contradicts is not ok") {
  const auto model = replica_model();
  const IcpTrackingOptions options;
  const IcpTracking tracking(*model, nominal_beam, options);
  const auto track = [&](const Mesh& mesh, const Pose& truth, const Pose& start) {
    ScanMaker lidar(mesh);
    lidar.pose = truth;
    const auto raw = lidar.sweep(around(*model, start, 2000));
    return tracking.track(preprocess(raw, {}, nominal_beam), {start, prior(0.03, radians(2)), {}});
  };
  SECTION("the target is elsewhere") {
    const TrackingResult r =
        track(model->target.mesh, {{1.5, 1, 8}, paper_pose.rotation}, paper_pose);
    CHECK_FALSE(r.ok);
    CHECK_FALSE(r.reason.empty());
  }
  SECTION("it is another target") {
    const TrackingResult r = track(make_box({3, 1.2, 0.6}), paper_pose, paper_pose);
    CHECK_FALSE(r.ok);
  }
  SECTION("only a wall is there") {
    const TrackingResult r = track(make_box({20, 20, 0.01}), {{0, 0, 8}, Quaterniond::Identity()},
                                   {{0, 0, 8}, Quaterniond::Identity()});
    CHECK_FALSE(r.ok);
  }
  SECTION("nothing is there") {
    const TrackingResult r =
        track(model->target.mesh, {{0, 0, 500}, Quaterniond::Identity()}, paper_pose);
    CHECK_FALSE(r.ok);
    CHECK(r.used == 0);
  }
}
