// SPDX-License-Identifier: BSD-3-Clause
// Every method that can be named works with every other.
#include "test/catch.h"
#include "test/estimator/node/fold_fixture.h"

using namespace berth;
using namespace berth::estimator;

namespace {

const Pose slow_pose = pose_from_xyzwpr({100, -100, 5500, 10, 8, -12});

/// Acquires and tracks a replica for some scans.
void check_run(EstimatorSetup setup, double error_m,
               const Velocity& velocity = {{0.005, 0, -0.01}, {0, 0.002, 0}}) {
  Loopback run(std::move(setup));
  run.lidar.pose = slow_pose;
  run.lidar.velocity = velocity;
  run.send(command(estimator_command_t::ACQUIRE, 1, 1));
  for (int i = 0; i < 7; ++i) REQUIRE(run.scan_once());
  INFO(run.last().method << ": " << run.last().reason);
  REQUIRE(run.last().status == pose_estimate_t::OK);
  const double late = static_cast<double>(run.last().utime - run.lidar.utime) * 1e-6;
  const Pose truth = moved(run.lidar.pose, run.lidar.velocity, late);
  CHECK(distance(pose_of(run.last()), truth) < error_m);
  CHECK(angle_between(pose_of(run.last()), truth) < radians(1.5));
}

}  // namespace

TEST_CASE("Every combination of acquisition, tracking and target tracker runs") {
  for (const std::string& acquisition : acquisition_names()) {
    for (const std::string& tracking : tracking_names()) {
      for (const std::string& tracker : tracker_names()) {
        DYNAMIC_SECTION(acquisition << ", " << tracking << ", " << tracker) {
          EstimatorSetup setup = test_setup();
          setup.options.acquisition_method = acquisition;
          setup.options.tracking_method = tracking;
          setup.options.tracker_method = tracker;
          // Information is planned for beams that meet the faces they were planned for; closest
          // points need returns from all over the target.
          if (tracking != "likelihood") setup.options.strategy = ScanStrategy::corners_sparse;
          check_run(std::move(setup), 0.015);
        }
      }
    }
  }
}

TEST_CASE("Every scan strategy of the paper runs with its published methods") {
  for (const std::string& strategy : scan_strategy_names()) {
    DYNAMIC_SECTION(strategy) {
      EstimatorSetup setup = test_setup("config/estimator_paper.yaml");
      CHECK(setup.options.acquisition_method == "voxel_template");
      CHECK(setup.options.tracking_method == "icp");
      CHECK(setup.options.tracker_method == "alpha_beta");
      REQUIRE(parse_scan_strategy(strategy, setup.options.strategy));
      // A dense scan takes ten seconds and more: the published methods want the target to stand.
      if (setup.options.strategy == ScanStrategy::dense) {
        check_run(std::move(setup), 0.025, {});
      } else {
        check_run(std::move(setup), 0.025);
      }
    }
  }
}
