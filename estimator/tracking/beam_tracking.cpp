// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_tracking.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"

namespace berth::estimator {

namespace {

std::string percent(double share) { return fixed(100 * share, 0) + " %"; }

/// Returns that fit worse than the beam model says are trusted that much less. Within what chance
/// does the model is right.
double variance_factor(const BeamInformation& sums) {
  const double used = std::max(1, sums.used);
  const double per_return = sums.chi2 / used;
  return per_return > 1 + 4 * std::sqrt(2 / used) ? per_return : 1;
}

}  // namespace

/// About as many returns as the approach needs, at the time of the prediction.
std::vector<Vector3d> BeamTracking::sample(const CleanScan& scan,
                                           const Prediction& predicted) const {
  const std::size_t stride = std::max<std::size_t>(
      1, scan.points.size() / static_cast<std::size_t>(options_.approach_returns));
  std::vector<Vector3d> points;
  points.reserve(scan.points.size() / stride + 1);
  for (std::size_t i = 0; i < scan.points.size(); i += stride) {
    const Vector3d& p = scan.points[i];
    const std::int64_t utime = scan.beams[scan.beam_of_point[i]].utime;
    const double late = options_.deskew ? static_cast<double>(utime - scan.utime_mean) * 1e-6 : 0;
    const Velocity& v = predicted.velocity;
    points.push_back(p - late * (v.linear + v.angular.cross(p - predicted.pose.position)));
  }
  return points;
}

std::string BeamTracking::judge(const TrackingResult& result, const BeamInformation& sums,
                                const Pose& predicted) const {
  if (sums.used + sums.doubtful < options_.least_used) {
    return std::to_string(sums.used + sums.doubtful) + " returns fit the target, at least " +
           std::to_string(options_.least_used) + " are needed";
  }
  const double against = sums.contradicted();
  if (against > options_.most_contradiction) {
    return percent(against) + " of the beams contradict the pose, at most " +
           percent(options_.most_contradiction) + " may";
  }
  const double chi2 = sums.chi2 / std::max(1, sums.used);
  if (chi2 > options_.most_chi2) {
    return "the returns spread " + fixed(chi2, 1) + " times the beam model's variance, at most " +
           fixed(options_.most_chi2, 1) + " times is trusted";
  }
  const double sigma = uncertainty_of_ends(model_, result.covariance);
  if (!(sigma < options_.most_uncertain_m)) {
    return "the returns do not determine all six degrees of freedom: the target's ends are known "
           "to " +
           fixed(1e3 * sigma, 0) + " mm";
  }
  return why_too_far(model_, predicted, result.pose, options_.most_shift_m, options_.most_turn_rad);
}

TrackingResult BeamTracking::track(const CleanScan& scan, const Prediction& predicted) const {
  TrackingResult result;
  result.pose = predicted.pose;
  result.covariance = predicted.covariance;
  const bool known = predicted.pose.position.allFinite() &&
                     predicted.pose.rotation.coeffs().allFinite() &&
                     predicted.covariance.allFinite();
  if (!known) {
    result.reason = "the prediction is not finite";
    return result;
  }
  if (static_cast<int>(scan.points.size()) < options_.least_used) {
    result.reason = std::to_string(scan.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.least_used) + " are needed";
    return result;
  }
  BeamDescent descent(model_, beam_model_, scan, predicted, options_.descent, options_.deskew);
  const double most = options_.most_settled_contradiction;
  const auto open = [this](const BeamDescent::Result& r) {
    return uncertainty_of_ends(model_, r.covariance) > options_.most_open_m;
  };
  const auto settled = [&](const BeamDescent::Result& r) { return r.sums.contradicted() <= most; };
  const auto credible = [&](const BeamDescent::Result& r) {
    return r.sums.contradicted() <= 2 * most && !open(r);
  };
  // The nearest surface misleads where parts lie side by side: a prediction that is good enough to
  // meet the right faces is a start of its own, and the likelier end counts.
  if (uncertainty_of_ends(model_, predicted.covariance) < options_.most_uncertain_start_m) {
    descent.refine(predicted.pose);
  }
  descent.run(approach(model_, sample(scan, predicted), predicted.pose, options_.approach));
  // Where a wide beam meets several faces their ranges tell little: what holds the pose is edges.
  const bool wide = options_.descent.information.likelihood.footprint;
  if (!wide) descent.rest();
  if (wide || !settled(descent.best())) {
    descent.search(settled, credible);
    descent.rest();
  }

  const BeamDescent::Result& best = descent.best();
  const BeamInformation& sums = best.sums;
  const double factor = variance_factor(sums);
  result.pose = best.motion.pose;
  result.covariance = factor * best.covariance;
  result.motion = descent.measured();
  if (result.motion) {
    result.motion->said.information /= factor;
    result.motion->said.gradient /= factor;
  }
  result.residual_rms = beam_model_.range_sigma_m * std::sqrt(sums.chi2 / std::max(1, sums.used));
  if (!descent.blurred()) result.spread = sums.chi2 / std::max(1, sums.used - 6);
  result.iterations = best.steps;
  result.used = sums.used + sums.doubtful;
  result.near = result.used + sums.blocked + sums.beside;
  result.fit = {-0.5 * sums.chi2, sums.predicted, sums.used, sums.through};
  result.confidence = static_cast<double>(sums.used) /
                      std::max(1, sums.used + sums.blocked + sums.beside + sums.through);
  result.reason = judge(result, sums, predicted.pose);
  result.ok = result.reason.empty();
  return result;
}

}  // namespace berth::estimator
