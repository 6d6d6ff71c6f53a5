// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/tracking_trial.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "test/benchmarks/cpu_time.h"

namespace berth::benchmark {
namespace {

Vector3d any_direction(Random& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

}  // namespace

Pose paper_pose() { return pose_from_xyzwpr({100, -230, 8000, 25, 20, -30}); }

Pose pose_off(const Pose& pose, double distance, double angle, Random& random) {
  Vector6d step;
  step.head<3>() = distance * any_direction(random);
  step.tail<3>() = angle * any_direction(random);
  return perturbed(pose, step);
}

Pose pose_around(const Pose& pose, double distance, double angle, Random& random) {
  const double a = std::cbrt(random.uniform());
  const double b = std::cbrt(random.uniform());
  return pose_off(pose, a * distance, b * angle, random);
}

TrackingTrial make_tracking_trial(const estimator::TargetModel& model, const TrackingCase& the_case,
                                  Random random) {
  TrackingTrial trial;
  trial.truth = pose_around(paper_pose(), the_case.around_m, the_case.around_rad, random);
  trial.predicted.pose = pose_off(trial.truth, the_case.start_m, the_case.start_rad, random);
  trial.predicted.covariance = Matrix6d::Zero();
  trial.predicted.covariance.diagonal().head<3>().setConstant(std::pow(the_case.start_m, 2) / 3);
  trial.predicted.covariance.diagonal().tail<3>().setConstant(std::pow(the_case.start_rad, 2) / 3);

  const World world(model.target.mesh, the_case.physics, random);
  std::vector<Window> windows;
  if (the_case.whole_target) {
    windows = {window_around(model.target.mesh, trial.predicted.pose, 0.05)};
    windows.front().count = the_case.returns;
  } else {
    const estimator::PlannerOptions options;
    const estimator::ScanPlanner planner(model, {}, options);
    const double sigma =
        std::hypot(the_case.start_m, the_case.start_rad * 0.5 * model.radius) / std::sqrt(3.0);
    windows = planner.plan(trial.predicted.pose, sigma, the_case.strategy, the_case.returns);
  }
  windows = scaled_to_returns(world, windows, trial.truth, the_case.returns);
  trial.scan = world.sweep(windows, trial.truth, random);
  trial.bound =
      cramer_rao_bound(fisher_information(trial.scan, trial.truth, the_case.physics.noise));
  return trial;
}

TrackingOutcome track(const estimator::Tracking& method, const BeamModel& noise,
                      const TrackingTrial& trial) {
  const estimator::PreprocessedScan clean = estimator::preprocess(trial.scan.beams, {1, 15}, noise);
  const double start = cpu_ms();
  const estimator::TrackingResult result = method.track(clean, trial.predicted);
  TrackingOutcome outcome;
  outcome.cpu_ms = cpu_ms() - start;
  outcome.ok = result.ok;
  outcome.error = difference(trial.truth, result.pose);
  outcome.nees = outcome.error.dot(result.covariance.ldlt().solve(outcome.error));
  outcome.bound = trial.bound;
  outcome.residual_rms = result.residual_rms;
  outcome.returns = trial.scan.returns;
  return outcome;
}

}  // namespace berth::benchmark
