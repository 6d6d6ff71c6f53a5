// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/single_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/track/validation.h"

namespace berth::estimator {

namespace {

/// Of a pose given by the user.
constexpr StartSigma given_sigma{0.1, radians(5)};
/// Of an acquired pose: half of the spacing of the returns on a disc of the target's radius; in
/// rotation, that at the disc's rim.
StartSigma acquired_sigma(std::size_t returns) {
  const double sigma = 0.5 * std::sqrt(std::numbers::pi / static_cast<double>(returns));
  return {sigma, sigma};
}

/// Distance from the found target, over its length, of returns that it explains.
constexpr double neighbourhood_of_length = 0.1;
/// Remaining returns over explained ones above which they are searched.
constexpr double min_remaining_share = 0.2;

PoseCandidate candidate_of(const Hypothesis& hypothesis) {
  PoseCandidate candidate;
  candidate.pose = hypothesis.pose;
  candidate.probability = hypothesis.probability;
  candidate.log_likelihood = hypothesis.log_likelihood;
  candidate.equal_poses = hypothesis.equal_poses;
  return candidate;
}

Pose scaled(Pose pose, double factor) {
  pose.position *= factor;
  return pose;
}

BeamModel scaled(BeamModel beam_model, double factor) {
  beam_model.range_sigma_m *= factor;
  beam_model.range_bias_m *= factor;
  beam_model.aperture_m *= factor;
  beam_model.range_min_m *= factor;
  beam_model.range_max_m *= factor;
  return beam_model;
}

PreprocessedScan scaled(PreprocessedScan scan, double factor) {
  for (Beam& beam : scan.beams) {
    beam.range *= factor;
    beam.range_sigma *= factor;
  }
  for (Vector3d& point : scan.points) point *= factor;
  return scan;
}

Matrix6d scaled(Matrix6d covariance, double factor) {
  covariance.topRows<3>() *= factor;
  covariance.leftCols<3>() *= factor;
  return covariance;
}

std::string why_no_points(const PreprocessedScan& scan) {
  if (scan.received == 0) return "the scan holds no beams";
  if (scan.misses + scan.repeated == scan.received) {
    return "none of the " + std::to_string(scan.received) + " beams returned";
  }
  return "none of the " + std::to_string(scan.received) +
         " beams returned from within the range gate";
}

}  // namespace

const char* name_of(SingleScanResult::Status status) {
  switch (status) {
    case SingleScanResult::Status::ok:
      return "ok";
    case SingleScanResult::Status::ambiguous:
      return "ambiguous";
    default:
      return "lost";
  }
}

SingleScan::SingleScan(const TargetModel& model, double scale, const EstimatorOptions& options,
                       const BeamModel& beam_model, std::function<std::int64_t()> stopwatch)
    : model_(model),
      scale_(scale),
      beam_model_(scaled(beam_model, 1 / scale)),
      stopwatch_(std::move(stopwatch)),
      acquisition_(make_acquisition(options, model, beam_model_)),
      tracking_(make_tracking(options, model, beam_model_)) {}

SingleScanResult SingleScan::estimate(const PreprocessedScan& scan,
                                      const std::optional<Pose>& initial) const {
  if (scale_ == 1) return estimate_scaled(scan, initial);
  const double shrink = 1 / scale_;
  std::optional<Pose> start;
  if (initial) start = scaled(*initial, shrink);
  SingleScanResult result = estimate_scaled(scaled(scan, shrink), start);
  for (PoseCandidate& candidate : result.candidates) {
    candidate.pose = scaled(candidate.pose, scale_);
    if (candidate.covariance) candidate.covariance = scaled(*candidate.covariance, scale_);
  }
  return result;
}

SingleScanResult SingleScan::estimate_scaled(const PreprocessedScan& scan,
                                             const std::optional<Pose>& initial) const {
  SingleScanResult result;
  if (scan.points.empty()) {
    result.reason = why_no_points(scan);
    return result;
  }
  if (!initial || !track_initial(scan, *initial, result)) acquire(scan, result);
  return result;
}

bool SingleScan::track_initial(const PreprocessedScan& scan, const Pose& initial,
                               SingleScanResult& result) const {
  const std::int64_t start = now();
  std::string lost;
  const PoseCandidate candidate = refined(scan, initial, given_sigma, lost);
  if (lost.empty()) result.candidates = {candidate};
  result.refine_us = now() - start;
  if (!lost.empty()) {
    result.notes.push_back("lost when tracked from the initial pose (" + lost +
                           "), hence acquired");
    return false;
  }
  result.status = SingleScanResult::Status::ok;
  return true;
}

void SingleScan::acquire(const PreprocessedScan& scan, SingleScanResult& result) const {
  const std::int64_t start = now();
  const AcquisitionResult found = acquisition_->acquire(scan);
  const std::int64_t acquired = now();
  result.acquired = true;
  result.acquire_us = acquired - start;
  result.reason = found.reason;
  if (found.status == AcquisitionResult::Status::found ||
      found.status == AcquisitionResult::Status::ambiguous) {
    refine(scan, found, result);
    if (result.status == SingleScanResult::Status::ok) search_remaining(scan, result);
    result.refine_us += now() - acquired;
    return;
  }
  for (const Hypothesis& h : found.hypotheses) result.candidates.push_back(candidate_of(h));
}

PoseCandidate SingleScan::refined(const PreprocessedScan& scan, const Pose& start,
                                  const StartSigma& sigma, std::string& failure) const {
  const double sigma_m = sigma.of_radius * model_.radius;
  Vector6d variances;
  variances << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma.rad * sigma.rad);
  const TrackingResult tracked = tracking_->track(scan, {start, variances.asDiagonal(), {}});
  const Vector6d moved = difference(start, tracked.pose);
  const bool same = moved.cwiseAbs2().cwiseQuotient(variances).sum() < pose_chi_squared_limit;
  PoseCandidate candidate;
  candidate.pose = tracked.ok && same ? tracked.pose : start;
  candidate.covariance = tracked.covariance;
  candidate.probability = 1;
  candidate.equal_poses = model_.symmetries.exact_count();
  candidate.used = tracked.used;
  failure =
      tracked.ok ? validation_failure(model_, beam_model_, scan, candidate.pose) : tracked.reason;
  return candidate;
}

void SingleScan::refine(const PreprocessedScan& scan, const AcquisitionResult& found,
                        SingleScanResult& result) const {
  std::string best_failure;
  bool any_valid = false;
  for (const Hypothesis& hypothesis : found.hypotheses) {
    std::string failure;
    PoseCandidate candidate =
        refined(scan, hypothesis.pose, acquired_sigma(scan.points.size()), failure);
    candidate.probability = hypothesis.probability;
    candidate.log_likelihood = hypothesis.log_likelihood;
    any_valid = any_valid || failure.empty();
    if (result.candidates.empty()) best_failure = failure;
    // Hypotheses may be refined to the same pose.
    const auto same =
        std::find_if(result.candidates.begin(), result.candidates.end(),
                     [&](const PoseCandidate& c) { return same_pose(c.pose, candidate.pose); });
    if (same == result.candidates.end()) {
      result.candidates.push_back(candidate);
    } else {
      same->probability += candidate.probability;
    }
    // A found pose has no rivals.
    if (found.status == AcquisitionResult::Status::found) break;
  }
  if (!any_valid) {
    result.reason = "the acquired pose fails validation: " + best_failure;
  } else if (result.candidates.size() > 1) {
    result.status = SingleScanResult::Status::ambiguous;
  } else {
    result.status = SingleScanResult::Status::ok;
    result.reason.clear();
  }
}

void SingleScan::search_remaining(const PreprocessedScan& scan, SingleScanResult& result) const {
  const Pose to_model = result.candidates.front().pose.inverse();
  const auto is_explained = [&](const Vector3d& point) {
    const Vector3d p = to_model * point;
    return (model_.caster.nearest(p) - p).norm() < neighbourhood_of_length * model_.target.length;
  };
  PreprocessedScan remaining;
  int explained = 0;
  constexpr std::size_t max_beams = 20000;
  const std::size_t stride = 1 + scan.beams.size() / max_beams;
  for (std::size_t i = 0; i < scan.beams.size(); i += stride) {
    const Beam& beam = scan.beams[i];
    if (beam.hit() && is_explained(beam.point())) {
      ++explained;
      continue;
    }
    remaining.beams.push_back(beam);
    if (!beam.hit()) {
      ++remaining.misses;
      continue;
    }
    remaining.points.push_back(beam.point());
    remaining.beam_of_point.push_back(static_cast<std::uint32_t>(remaining.beams.size() - 1));
  }
  if (static_cast<double>(remaining.points.size()) < min_remaining_share * explained) return;
  const AcquisitionResult found = acquisition_->acquire(remaining);
  if (found.status != AcquisitionResult::Status::found &&
      found.status != AcquisitionResult::Status::ambiguous) {
    return;
  }
  for (const Hypothesis& hypothesis : found.hypotheses) {
    std::string failure;
    PoseCandidate other =
        refined(remaining, hypothesis.pose, acquired_sigma(remaining.points.size()), failure);
    other.log_likelihood = hypothesis.log_likelihood;
    if (failure.empty()) result.candidates.push_back(other);
  }
  if (result.candidates.size() == 1) return;
  // Each explains different returns: their likelihoods are not comparable.
  for (PoseCandidate& c : result.candidates) {
    c.probability = 1.0 / static_cast<double>(result.candidates.size());
  }
  result.status = SingleScanResult::Status::ambiguous;
  result.reason = "two things in the scan look like the target";
}

bool SingleScan::same_pose(const Pose& a, const Pose& b) const {
  return model_.symmetries.distance(a, b) < 0.01 * model_.radius &&
         model_.symmetries.angle_between(a, b) < radians(1);
}

BeamModel without_range_limits(BeamModel beam_model) {
  beam_model.range_min_m = 0;
  beam_model.range_max_m = 1e5;
  return beam_model;
}

}  // namespace berth::estimator
