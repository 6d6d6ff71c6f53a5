// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/single_scan.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

namespace {

/// How well a pose to start from is known: of the target's radius, and rad.
constexpr double start_sigma_of_radius = 0.1;
constexpr double start_sigma_rad = radians(5);

PoseCandidate candidate_of(const TrackingResult& tracked) {
  PoseCandidate candidate;
  candidate.pose = tracked.pose;
  candidate.covariance = tracked.covariance;
  candidate.probability = 1;
  candidate.log_likelihood = tracked.fit.log_likelihood;
  candidate.used = tracked.used;
  return candidate;
}

PoseCandidate candidate_of(const Hypothesis& hypothesis) {
  PoseCandidate candidate;
  candidate.pose = hypothesis.pose;
  candidate.probability = hypothesis.probability;
  candidate.log_likelihood = hypothesis.log_likelihood;
  candidate.equal_poses = hypothesis.equal_poses;
  return candidate;
}

std::string why_no_points(const CleanScan& scan) {
  if (scan.received == 0) return "the scan holds no beams";
  if (scan.misses == scan.received) {
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

SingleScan::SingleScan(const TargetModel& model, const EstimatorOptions& options,
                       const BeamModel& beam_model, std::function<std::int64_t()> stopwatch)
    : model_(model),
      stopwatch_(std::move(stopwatch)),
      acquisition_(make_acquisition(options, model, beam_model)),
      tracking_(make_tracking(options, model, beam_model)) {}

SingleScanResult SingleScan::estimate(const CleanScan& scan,
                                      const std::optional<Pose>& initial) const {
  SingleScanResult result;
  if (scan.points.empty()) {
    result.reason = why_no_points(scan);
    return result;
  }
  if (!initial || !track_initial(scan, *initial, result)) acquire(scan, result);
  return result;
}

TrackingResult SingleScan::track(const CleanScan& scan, const Pose& start) const {
  const double sigma_m = start_sigma_of_radius * model_.radius;
  Vector6d variances;
  variances << Vector3d::Constant(sigma_m * sigma_m),
      Vector3d::Constant(start_sigma_rad * start_sigma_rad);
  return tracking_->track(scan, {start, variances.asDiagonal(), {}});
}

bool SingleScan::track_initial(const CleanScan& scan, const Pose& initial,
                               SingleScanResult& result) const {
  const std::int64_t start = now();
  const TrackingResult tracked = track(scan, initial);
  result.refine_us = now() - start;
  if (!tracked.ok) {
    result.notes.push_back("lost when tracked from the initial pose (" + tracked.reason +
                           "), hence acquired");
    return false;
  }
  result.status = SingleScanResult::Status::ok;
  result.candidates = {candidate_of(tracked)};
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
    result.refine_us += now() - acquired;
    return;
  }
  for (const Hypothesis& h : found.hypotheses) result.candidates.push_back(candidate_of(h));
}

void SingleScan::refine(const CleanScan& scan, const AcquisitionResult& found,
                        SingleScanResult& result) const {
  std::string best_lost;  // why refinement lost the most probable one
  for (const Hypothesis& hypothesis : found.hypotheses) {
    PoseCandidate candidate = candidate_of(hypothesis);
    const TrackingResult tracked = track(scan, hypothesis.pose);
    if (tracked.ok) {
      candidate.pose = tracked.pose;
      candidate.covariance = tracked.covariance;
      candidate.used = tracked.used;
    } else if (result.candidates.empty()) {
      best_lost = tracked.reason;
    }
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
  if (result.candidates.size() > 1) {
    result.status = SingleScanResult::Status::ambiguous;
  } else if (best_lost.empty()) {
    result.status = SingleScanResult::Status::ok;
    result.reason.clear();
  } else {
    result.reason = "the acquired pose does not stand when refined: " + best_lost;
  }
}

bool SingleScan::same_pose(const Pose& a, const Pose& b) const {
  return (a * model_.centre - b * model_.centre).norm() < 0.01 * model_.radius &&
         angle_between(a, b) < radians(1);
}

BeamModel without_range_limits(BeamModel beam_model) {
  beam_model.range_min_m = 0;
  beam_model.range_max_m = 1e5;
  return beam_model;
}

}  // namespace berth::estimator
