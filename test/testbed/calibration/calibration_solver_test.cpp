// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "common/core/error.h"
#include "test/catch.h"
#include "test/testbed/calibration/calibration_made_run.h"
#include "testbed/calibration/observability.h"

namespace berth::testbed {
namespace {

TEST_CASE("from scans alone a wrong cell is found out, and its clocks") {
  for (const std::uint64_t seed : {1, 2}) {
    MadeWorld world(seed, 0.5);
    CalibrationProblem problem{world.nominal, world.prior, {}, 0.0005};
    problem.runs.push_back(world.run(60, 60, 0.3e-3, radians(0.01)));
    CHECK(world.error_of(Eigen::VectorXd::Zero(calibration_size)).position > 5e-3);
    const CalibrationSolution solution = solve_calibration(problem);
    const auto error = world.error_of(solution.values);
    CHECK(error.position < 0.5e-3);
    CHECK(error.rotation < radians(0.03));
    for (const ArmRole role : both_arms) {
      const int i = time_index(role);
      CHECK(std::abs(solution.values[i] - world.values[i]) < 2e-3);
    }
    CHECK(solution.chi2_per_dof == Approx(1).epsilon(0.3));
    CHECK_FALSE(solution.with_tracker);
  }
}

TEST_CASE("the covariance is consistent with the calibrated cell's error") {
  // normalised squared errors of truth, 6 each, over poses and worlds
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 11; seed < 15; ++seed) {
    MadeWorld world(seed, 0.3);
    CalibrationProblem problem{world.nominal, world.prior, {}, 0.0005};
    problem.runs.push_back(world.run(40, 0, 0.3e-3, radians(0.01)));
    const CalibrationSolution solution = solve_calibration(problem);
    const Cell cell = apply_calibration(world.nominal, solution.values);
    Calibration calibration;
    calibration.covariance = solution.covariance;
    for (int i = 0; i < 20; ++i) {
      const ArmPair joints = world.configuration();
      const Vector6d error = difference(cell.relative_pose(joints.replica, joints.sensor),
                                        world.world.relative_pose(joints.replica, joints.sensor));
      const Matrix6d covariance = calibration_covariance(cell, calibration, joints);
      sum += error.dot(covariance.ldlt().solve(error));
      ++count;
    }
  }
  CHECK(sum / count > 3);
  CHECK(sum / count < 12);
}

TEST_CASE("unobservable parameters are named") {
  MadeWorld world(3, 0.3);
  CalibrationProblem problem{world.nominal, world.prior, {}, 0.0005};
  problem.runs.push_back(world.run(60, 40, 0.3e-3, radians(0.01)));
  const CalibrationSolution solution = solve_calibration(problem);
  const auto found = find_unobservable(solution.information, world.prior);
  std::string all;
  for (const auto& direction : found) all += direction.text + "\n";
  INFO(all);
  CHECK(found.size() == 7);
  for (const char* text :
       {"replica arm's first joint against the base", "sensor arm's first joint against the base",
        "replica arm's last joint against the mount", "sensor arm's last joint against the mount",
        "all clocks together"}) {
    CHECK(all.find(text) != std::string::npos);
  }
}

TEST_CASE("with a tracker a biased sensor does not bend the cell, and its bias comes out") {
  const TrackerSetup setup = load_tracker_setup("config/tracker.yaml");
  MadeWorld world(4, 0.5);
  Vector6d bias;
  bias << 0, 0, 5e-3, 0, 0, 0;
  CalibrationRun run = world.run(40, 30, 0.3e-3, radians(0.01), bias);
  CalibrationProblem problem{world.nominal, world.prior, {run}, setup.time_sigma};
  const CalibrationSolution by_scans = solve_calibration(problem);
  CHECK(world.error_of(by_scans.values).position > 3e-3);  // the sensor's bias has become truth's

  world.add_readings(problem.runs.front(), setup,
                     pose_from_xyzwpr({1500, 2500, -700, 10, -5, 120}));
  const CalibrationSolution solution = solve_calibration(problem);
  CHECK(solution.with_tracker);
  const auto error = world.error_of(solution.values);
  CHECK(error.position < 0.1e-3);
  CHECK(error.rotation < radians(0.01));
  CHECK(solution.scan_bias[2] == Approx(5e-3).margin(0.3e-3));
}

TEST_CASE("a few estimates gone astray do not bend the cell") {
  MadeWorld world(6, 0.3);
  CalibrationRun run = world.run(50, 0, 0.3e-3, radians(0.01));
  for (const std::size_t i : {7u, 21u, 33u}) run.scans[i].pose.position.x() += 0.1;
  CalibrationProblem problem{world.nominal, world.prior, {run}, 0.0005};
  const CalibrationSolution solution = solve_calibration(problem);
  CHECK(world.error_of(solution.values).position < 1e-3);
  const auto& residual = solution.residuals.front();
  CHECK((residual.where == "pose 8" || residual.where == "pose 22" || residual.where == "pose 34"));
}

TEST_CASE("too little is refused") {
  MadeWorld world(5, 0.3);
  CalibrationProblem problem{world.nominal, world.prior, {}, 0.0005};
  problem.runs.push_back(world.run(8, 0, 0.3e-3, radians(0.01)));
  CHECK_THROWS_AS(solve_calibration(problem), InputError);
}

}  // namespace
}  // namespace berth::testbed
