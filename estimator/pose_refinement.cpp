// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/pose_refinement.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/beam_selection.h"
#include "estimator/verification.h"

namespace berth::estimator {

namespace {

/// Beams of a scan that steps and likelihoods look at.
constexpr std::size_t most_stepped = 20000;
constexpr std::size_t most_weighed = 4000;

std::size_t stride_for(const CleanScan& scan, std::size_t most) {
  return 1 + scan.beams.size() / (most + 1);
}

/// Gauss-Newton steps on the beams' likelihood.
RefinedPose stepped(const TargetModel& model, const BeamModel& beam_model, const CleanScan& scan,
                    const Prediction& start, bool footprint, int steps) {
  const BeamPicks picks = evenly(scan.beams.size(), most_stepped);
  const double all = static_cast<double>(scan.beams.size()) /
                     static_cast<double>(std::max<std::size_t>(1, picks.size()));
  BeamInformationOptions of_pose;
  of_pose.of_velocity = false;
  of_pose.likelihood.footprint = footprint;
  const Matrix6d bound = start.covariance.inverse();
  const double rough = 0.005 * model.target.length;  // what a good start is off by
  Matrix6d off = Matrix6d::Zero();
  off.diagonal() << Vector3d::Constant(rough * rough),
      Vector3d::Constant(rough * rough / (model.radius * model.radius));
  RefinedPose result;
  BeamLinearisation at{{start.pose, {}}, scan.utime_mean, off};
  for (int i = 0;; ++i) {
    const BeamInformation sums =
        beam_information(model, beam_model, scan.beams, at, of_pose, picks);
    const Matrix6d information = all * sums.information[0] + bound;
    result.covariance = information.inverse();
    result.used = static_cast<int>(std::lround(all * sums.used));
    if (i == steps) break;
    at.pose = perturbed(at.pose, result.covariance * (all * sums.gradient[0]));
    at.covariance = result.covariance;
  }
  result.pose = at.pose;
  return result;
}

}  // namespace

RefinedPose refine_pose(const TargetModel& model, const BeamModel& beam_model,
                        const LikelihoodOptions& likelihood, const Tracking& tracking,
                        const CleanScan& scan, const Prediction& start) {
  constexpr int steps = 5;
  RefinedPose best = stepped(model, beam_model, scan, start, likelihood.footprint, 0);
  const auto weigh = [&](RefinedPose& refined) {
    refined.log_likelihood = beam_likelihood(model, beam_model, scan.beams, refined.pose,
                                             stride_for(scan, most_weighed), likelihood)
                                 .log_likelihood;
  };
  weigh(best);
  const auto challenge = [&](RefinedPose other) {
    weigh(other);
    if (other.log_likelihood > best.log_likelihood) best = std::move(other);
  };
  challenge(stepped(model, beam_model, scan, start, likelihood.footprint, steps));
  const TrackingResult tracked = tracking.track(scan, start);
  if (tracked.ok) challenge({tracked.pose, tracked.covariance, tracked.used, 0, ""});
  best.doubts = doubt(model, beam_model, scan, best.pose);
  return best;
}

}  // namespace berth::estimator
