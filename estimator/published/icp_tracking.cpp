// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/icp_tracking.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "estimator/published/beam_registration.h"
#include "estimator/scan/at_mean_time.h"

namespace berth::estimator {

std::string IcpTracking::name() const {
  return options_.icp.registration == Registration::point_to_point ? "icp point_to_point"
                                                                   : "icp point_to_plane";
}

std::vector<Vector3d> IcpTracking::points_of(const CleanScan& still) const {
  const std::size_t stride = 1 + still.points.size() / (options_.max_points + 1);
  std::vector<Vector3d> points;
  points.reserve(still.points.size() / stride + 1);
  for (std::size_t i = 0; i < still.points.size(); i += stride) points.push_back(still.points[i]);
  return points;
}

std::string IcpTracking::judge(const TrackingResult& result, const IcpResult& icp,
                               const Likelihood& fit, const Pose& predicted) const {
  if (icp.used < options_.min_used) {
    return std::to_string(icp.used) + " returns fit the target, at least " +
           std::to_string(options_.min_used) + " are needed";
  }
  if (!icp.constrained) return "the returns do not determine all six degrees of freedom";
  if (icp.inlier_share() < options_.min_inlier_share) {
    return "only " + fixed(100 * icp.inlier_share(), 0) +
           " % of the returns about the target fit it";
  }
  if (icp.residual_rms > options_.max_residual_m) {
    return "residual " + fixed(1e3 * icp.residual_rms, 1) + " mm, at most " +
           fixed(1e3 * options_.max_residual_m, 1) + " mm is trusted";
  }
  const std::string far =
      why_too_far(model_, predicted, result.pose, options_.max_shift_m, options_.max_turn_rad);
  if (!far.empty()) return far;
  const double predicted_beams = std::max(1, fit.predicted);
  if (fit.explained < options_.min_explained * predicted_beams) {
    return "only " + fixed(100 * fit.explained / predicted_beams, 0) +
           " % of the beams that should meet the target return from it";
  }
  if (fit.through > options_.max_through * predicted_beams) {
    return fixed(100 * fit.through / predicted_beams, 0) +
           " % of the beams that should meet the target go through it";
  }
  return "";
}

TrackingResult IcpTracking::track(const CleanScan& skewed, const Prediction& predicted) const {
  const CleanScan scan =
      options_.deskew ? at_mean_time(skewed, predicted.velocity, predicted.pose.position) : skewed;
  TrackingResult result;
  const IcpResult icp = align(model_, points_of(scan), predicted.pose, options_.icp);
  result.pose = icp.pose;
  result.residual_rms = icp.residual_rms;
  result.iterations = icp.iterations;
  result.used = icp.used;
  result.near = icp.near;
  constexpr std::size_t max_beams = 4000;
  for (int i = 0; i < options_.beam_steps; ++i) {
    const BeamStep refined =
        beam_step(model_, scan.beams, result.pose, options_.icp.min_gate_m, max_beams);
    result.pose = perturbed(result.pose, refined.step);
  }

  constexpr std::size_t beams_checked = 300;
  const std::size_t stride = std::max<std::size_t>(1, scan.beams.size() / beams_checked);
  const Likelihood fit =
      beam_likelihood(model_, beam_model_, scan.beams, result.pose, stride, options_.likelihood);
  result.confidence = icp.inlier_share() * fit.explained / std::max(1, fit.predicted);

  // Residuals to closest points hide noise: a return that the noise carries through a panel is
  // close to its other side. Beams show it, and what they would still correct is a systematic
  // error.
  const BeamStep against =
      beam_step(model_, scan.beams, result.pose, 3 * options_.icp.min_gate_m, max_beams);
  const double sigma = std::max({icp.residual_rms, against.sigma, beam_model_.range_sigma_m});
  // Directions that the returns do not hold stay as uncertain as the prediction; its own covariance
  // is only used, three sigma wide, to bound them.
  const Matrix6d bound = (9 * predicted.covariance).ldlt().solve(Matrix6d::Identity());
  const Matrix6d information =
      icp.information / (options_.covariance_scale * sigma * sigma) + bound;
  result.covariance = information.ldlt().solve(Matrix6d::Identity());
  result.covariance = Matrix6d(0.5 * (result.covariance + result.covariance.transpose()));
  result.covariance += against.step * against.step.transpose();
  result.covariance.diagonal().head<3>().array() += options_.floor_m * options_.floor_m;
  result.covariance.diagonal().tail<3>().array() += options_.floor_rad * options_.floor_rad;

  result.reason = judge(result, icp, fit, predicted.pose);
  result.ok = result.reason.empty();
  return result;
}

}  // namespace berth::estimator
