// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_tracking.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/core/text.h"

namespace berth::estimator {

namespace {

/// Information of a prior three times as wide as the prediction: what no return holds stays there.
Matrix6d bound_of(const Matrix6d& covariance) {
  return (9 * covariance + 1e-12 * Matrix6d::Identity()).ldlt().solve(Matrix6d::Identity());
}

/// Of returns, about so many, at the time of the prediction.
std::vector<Vector3d> sample(const CleanScan& scan, const Prediction& predicted, bool deskew,
                             int count) {
  const std::size_t stride =
      std::max<std::size_t>(1, scan.points.size() / static_cast<std::size_t>(count));
  std::vector<Vector3d> points;
  points.reserve(scan.points.size() / stride + 1);
  for (std::size_t i = 0; i < scan.points.size(); i += stride) {
    const Vector3d& p = scan.points[i];
    const Velocity& v = predicted.velocity;
    if (!deskew) {
      points.push_back(p);
      continue;
    }
    const std::int64_t utime = scan.beams[scan.beam_of_point[i]].utime;
    const double late = static_cast<double>(utime - scan.utime_mean) * 1e-6;
    points.push_back(p - late * (v.linear + v.angular.cross(p - predicted.pose.position)));
  }
  return points;
}

}  // namespace

BeamTracking::Fit BeamTracking::fit(const CleanScan& scan, const Prediction& predicted,
                                    const Pose& start) const {
  Fit fit;
  const Matrix6d bound = bound_of(predicted.covariance);
  BeamLinearisation at{start, {}, scan.utime_mean, Matrix6d::Zero()};
  if (options_.deskew) at.velocity = predicted.velocity;
  BeamInformationOptions of_pose = options_.information;
  of_pose.of_velocity = false;
  // The approach is good to about this.
  const double rough = 0.02;
  at.covariance.diagonal() << Vector3d::Constant(rough * rough),
      Vector3d::Constant(rough * rough / (model_.radius * model_.radius));
  const auto step = [&](std::size_t stride) {
    fit.sums = beam_information(model_, beam_model_, scan.beams, at, of_pose, stride);
    const Matrix6d information = fit.sums.information[0] + bound;
    const Eigen::LDLT<Matrix6d> solver(information);
    fit.covariance = solver.solve(Matrix6d::Identity());
    const Vector6d d =
        solver.solve(fit.sums.gradient[0] + bound * difference(at.pose, predicted.pose));
    at.pose = perturbed(at.pose, d);
    at.covariance = fit.covariance;
    ++fit.steps;
    return d.dot(information * d);  // in squared sigmas
  };
  const std::size_t stride =
      std::max<std::size_t>(1, scan.beams.size() / static_cast<std::size_t>(options_.settle_beams));
  for (int i = 0; i < options_.max_settle_steps; ++i) {
    if (step(stride) < 0.1) break;
  }
  for (int i = 0; i < 3; ++i) {
    if (step(1) < 0.3) break;
  }
  fit.pose = at.pose;
  return fit;
}

std::string BeamTracking::judge(const TrackingResult& result, const Fit& fit,
                                const Pose& predicted) const {
  if (result.used < options_.least_used) {
    return std::to_string(result.used) + " returns fit the target, at least " +
           std::to_string(options_.least_used) + " are needed";
  }
  const int free = fit.sums.used + fit.sums.through;
  const double explained = static_cast<double>(fit.sums.used) / std::max(1, free);
  if (explained < options_.least_explained) {
    return "only " + fixed(100 * explained, 0) +
           " % of the beams that should meet the target return from it";
  }
  const double shift = (result.pose * model_.centre - predicted * model_.centre).norm();
  if (shift > options_.most_shift_m) {
    return "the pose is " + fixed(1e3 * shift, 0) + " mm from the prediction, at most " +
           fixed(1e3 * options_.most_shift_m, 0) + " mm is trusted";
  }
  const double turn = angle_between(predicted, result.pose);
  if (turn > options_.most_turn_rad) {
    return "the attitude is " + fixed(degrees(turn), 1) + " deg from the prediction, at most " +
           fixed(degrees(options_.most_turn_rad), 1) + " deg is trusted";
  }
  return "";
}

TrackingResult BeamTracking::track(const CleanScan& scan, const Prediction& predicted) const {
  TrackingResult result;
  result.pose = predicted.pose;
  result.covariance = predicted.covariance;
  const Pose near =
      approach(model_, sample(scan, predicted, options_.deskew, options_.approach_returns),
               predicted.pose, options_.approach);
  const Fit best = fit(scan, predicted, near);
  result.pose = best.pose;
  result.covariance = 0.5 * (best.covariance + best.covariance.transpose());
  result.iterations = best.steps;
  result.used = best.sums.used;
  result.near = best.sums.used + best.sums.through;
  result.residual_rms =
      beam_model_.range_sigma_m * std::sqrt(best.sums.chi2 / std::max(1, best.sums.used));
  result.fit = {-0.5 * best.sums.chi2, best.sums.predicted, best.sums.used, best.sums.through};
  result.confidence = static_cast<double>(result.used) / std::max(1, result.near);
  result.reason = judge(result, best, predicted.pose);
  result.ok = result.reason.empty();
  return result;
}

}  // namespace berth::estimator
