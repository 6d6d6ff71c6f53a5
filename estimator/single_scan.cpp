// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/single_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/track/validation.h"

namespace berth::estimator {

namespace {

/// How well a pose to start from is known.
constexpr StartSigma as_given{0.1, radians(5)};
/// A pose that was acquired: half of the distance between so many returns, spread over a disc that
/// holds the target; turned, that at the disc's rim.
StartSigma as_acquired(std::size_t returns) {
  const double sigma = 0.5 * std::sqrt(std::numbers::pi / static_cast<double>(returns));
  return {sigma, sigma};
}

/// Returns nearer to it than this, of its length, are taken to be the target's.
constexpr double about_of_length = 0.1;
/// When so many others are left, of those taken, the target is looked for among them too.
constexpr double rest_worth_a_look = 0.2;

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

CleanScan scaled(CleanScan scan, double factor) {
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

std::string why_no_points(const CleanScan& scan) {
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

SingleScanResult SingleScan::estimate(const CleanScan& scan,
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

SingleScanResult SingleScan::estimate_scaled(const CleanScan& scan,
                                             const std::optional<Pose>& initial) const {
  SingleScanResult result;
  if (scan.points.empty()) {
    result.reason = why_no_points(scan);
    return result;
  }
  if (!initial || !track_initial(scan, *initial, result)) acquire(scan, result);
  return result;
}

bool SingleScan::track_initial(const CleanScan& scan, const Pose& initial,
                               SingleScanResult& result) const {
  const std::int64_t start = now();
  std::string lost;
  const PoseCandidate candidate = refined(scan, initial, as_given, lost);
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

void SingleScan::acquire(const CleanScan& scan, SingleScanResult& result) const {
  const std::int64_t start = now();
  const AcquisitionResult found = acquisition_->acquire(scan);
  const std::int64_t acquired = now();
  result.acquired = true;
  result.acquire_us = acquired - start;
  result.reason = found.reason;
  if (found.status == AcquisitionResult::Status::found ||
      found.status == AcquisitionResult::Status::ambiguous) {
    refine(scan, found, result);
    if (result.status == SingleScanResult::Status::ok) look_again(scan, result);
    result.refine_us += now() - acquired;
    return;
  }
  for (const Hypothesis& h : found.hypotheses) result.candidates.push_back(candidate_of(h));
}

PoseCandidate SingleScan::refined(const CleanScan& scan, const Pose& start, const StartSigma& sigma,
                                  std::string& doubts) const {
  const double sigma_m = sigma.of_radius * model_.radius;
  Vector6d variances;
  variances << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma.rad * sigma.rad);
  const TrackingResult tracked = tracking_->track(scan, {start, variances.asDiagonal(), {}});
  const Vector6d moved = difference(start, tracked.pose);
  const bool same = moved.cwiseAbs2().cwiseQuotient(variances).sum() < one_in_a_million;
  PoseCandidate candidate;
  candidate.pose = tracked.ok && same ? tracked.pose : start;
  candidate.covariance = tracked.covariance;
  candidate.probability = 1;
  candidate.equal_poses = model_.symmetries.exact_count();
  candidate.used = tracked.used;
  doubts = tracked.ok ? doubt(model_, beam_model_, scan, candidate.pose) : tracked.reason;
  return candidate;
}

void SingleScan::refine(const CleanScan& scan, const AcquisitionResult& found,
                        SingleScanResult& result) const {
  std::string best_doubts;
  bool any_stands = false;
  for (const Hypothesis& hypothesis : found.hypotheses) {
    std::string doubts;
    PoseCandidate candidate =
        refined(scan, hypothesis.pose, as_acquired(scan.points.size()), doubts);
    candidate.probability = hypothesis.probability;
    candidate.log_likelihood = hypothesis.log_likelihood;
    any_stands = any_stands || doubts.empty();
    if (result.candidates.empty()) best_doubts = doubts;
    // Refined, two may turn out to be one.
    const auto same =
        std::find_if(result.candidates.begin(), result.candidates.end(),
                     [&](const PoseCandidate& c) { return same_pose(c.pose, candidate.pose); });
    if (same == result.candidates.end()) {
      result.candidates.push_back(candidate);
    } else {
      same->probability += candidate.probability;
    }
    // What acquisition was sure of needs no others.
    if (found.status == AcquisitionResult::Status::found) break;
  }
  if (!any_stands) {
    result.reason = "the acquired pose does not stand: " + best_doubts;
  } else if (result.candidates.size() > 1) {
    result.status = SingleScanResult::Status::ambiguous;
  } else {
    result.status = SingleScanResult::Status::ok;
    result.reason.clear();
  }
}

void SingleScan::look_again(const CleanScan& scan, SingleScanResult& result) const {
  const Pose to_model = result.candidates.front().pose.inverse();
  const auto belongs = [&](const Vector3d& point) {
    const Vector3d p = to_model * point;
    return (model_.caster.nearest(p) - p).norm() < about_of_length * model_.target.length;
  };
  CleanScan rest;
  int taken = 0;
  constexpr std::size_t max_beams = 20000;
  const std::size_t stride = 1 + scan.beams.size() / max_beams;
  for (std::size_t i = 0; i < scan.beams.size(); i += stride) {
    const Beam& beam = scan.beams[i];
    if (beam.hit() && belongs(beam.point())) {
      ++taken;
      continue;
    }
    rest.beams.push_back(beam);
    if (!beam.hit()) {
      ++rest.misses;
      continue;
    }
    rest.points.push_back(beam.point());
    rest.beam_of_point.push_back(static_cast<std::uint32_t>(rest.beams.size() - 1));
  }
  if (static_cast<double>(rest.points.size()) < rest_worth_a_look * taken) return;
  const AcquisitionResult found = acquisition_->acquire(rest);
  if (found.status != AcquisitionResult::Status::found &&
      found.status != AcquisitionResult::Status::ambiguous) {
    return;
  }
  for (const Hypothesis& hypothesis : found.hypotheses) {
    std::string doubts;
    PoseCandidate other = refined(rest, hypothesis.pose, as_acquired(rest.points.size()), doubts);
    other.log_likelihood = hypothesis.log_likelihood;
    if (doubts.empty()) result.candidates.push_back(other);
  }
  if (result.candidates.size() == 1) return;
  // Each explains other returns: their likelihoods cannot be compared.
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
