// SPDX-License-Identifier: BSD-3-Clause
// Acquisition, and long range: position and a coarse axis, until the pose is observable.
#include <algorithm>
#include <berth/event_t.hpp>
#include <cmath>

#include "estimator/acquire/discriminating_windows.h"
#include "estimator/beam/scan.h"
#include "estimator/node/estimator.h"
#include "estimator/node/messages.h"

namespace berth::estimator {
namespace {

// Above this attitude uncertainty the filter's attitude is unknown.
constexpr double known_attitude_sigma_rad = 0.5;

}  // namespace

/// Without a pose: near targets are acquired, far ones located.
void Estimator::acquire(const PreprocessedScan& scan, pose_estimate_t& estimate,
                        Durations& durations) {
  const std::int64_t start = setup_.stopwatch();
  const bool was_zoomed = !zoom_.empty();
  zoom_.clear();
  zoom_scans_ = was_zoomed ? zoom_scans_ + 1 : 0;
  noise_.reset();
  estimate.status = pose_estimate_t::ACQUIRING;
  const LongRangeFix far = long_range_->find(scan);
  const double distance = far.pose.position.norm();
  if (far.used > 0 &&
      ranges_->suited(distance, OperatingRange::medium_range) == OperatingRange::long_range) {
    acquire_far(far, was_zoomed, scan, estimate);
    durations.acquire = setup_.stopwatch() - start;
    return;
  }
  const Found found = find_pose(scan, {}, estimate);
  durations.acquire = setup_.stopwatch() - start;
  const double margin = 0.1 * model_->canonical.half_length;
  // If a command sets the number of returns, a search only locates the target for a zoomed scan.
  if (found.measured && !was_zoomed && now_.acquire_returns > 0) {
    set_zoom(zoom_windows(found.measured->pose, margin), {found.measured->pose});
    if (!zoom_.empty()) {
      fill_filtered(estimate);
      estimate.reason = "located, to be scanned with the returns requested";
      return;
    }
  }
  if (found.measured) {
    start_from(found.measured->pose, found.measured->covariance, scan.utime_mean);
    fill_measurement(*found.measured, estimate);
    fill_filtered(estimate);
    estimate.status = pose_estimate_t::OK;
    estimate.reason.clear();
    change_mode(Mode::TRACKING, "tracking");
    return;
  }
  fill_filtered(estimate);
  if (found.status == AcquisitionResult::Status::ambiguous) {
    estimate.status = pose_estimate_t::AMBIGUOUS;
    fill_hypotheses(found.hypotheses, estimate);
  }
  if (found.status == AcquisitionResult::Status::refused) {
    change_mode(Mode::LOST, estimate.reason);
    estimate.status = pose_estimate_t::LOST;
  }
  // The next scan zooms to a hypothesis with a probability above 1/2. Otherwise, or after a zoomed
  // scan without a result, it covers the whole field of view.
  std::vector<Pose> open;
  double probability = 0;
  for (const Hypothesis& h : hints_) {
    open.push_back(h.pose);
    probability += h.probability;
  }
  std::vector<Window> where;
  if (found.status == AcquisitionResult::Status::ambiguous) {
    // Half of the beams where the hypotheses differ, half on all of the target.
    const int beams = setup_.options.zoom_beams;
    const double surface_sigma =
        surface_sigma_of(*model_, setup_.options.hypotheses.bare_surface_sigma_m);
    where = discriminating_windows(*model_, hints_, field_of_view(), beams / 2, setup_.lidar.beam,
                                   surface_sigma);
    const std::vector<Window> all =
        planner_->around(open, margin, where.empty() ? beams : beams / 2);
    where.insert(where.end(), all.begin(), all.end());
  } else if (!was_zoomed && probability > 0.5) {
    where = zoom_windows(open.front(), 3 * margin);
  }
  set_zoom(where, open);
  if (was_zoomed) return;
  // One search may have been disturbed; after a second one with returns and without a target, beams
  // are added.
  const bool met_something = !scan.points.empty();
  searches_ = zoom_.empty() && met_something ? searches_ + 1 : 0;
  if (zoom_.empty() && (!met_something || searches_ > 1)) densify_search(met_something);
}

/// Acquires the pose of a target that may move and measures it. Undecided hypotheses become hints
/// of the next scan.
Estimator::Found Estimator::find_pose(const PreprocessedScan& scan, const Velocity& velocity,
                                      pose_estimate_t& estimate) {
  Found result;
  const Vector3d origin = scan.points.empty() ? Vector3d::Zero() : scan.points.front();
  const AcquisitionResult found =
      acquisition_->acquire(at_mean_time(scan, velocity, origin), hints_);
  hints_.clear();
  estimate.method = acquisition_->name();
  estimate.reason = found.reason;
  result.status = found.status;
  result.hypotheses = found.hypotheses;
  hints_ = found.hypotheses;
  if (found.status != AcquisitionResult::Status::found) return result;
  noise_.start_at(noise_.factor() * found.noise_scale);
  const TrackingResult measured =
      measure(scan, {found.hypotheses.front().pose, resumed_covariance(), velocity});
  estimate.confidence = measured.confidence;
  if (!measured.ok) {
    estimate.reason = "the pose found fails validation: " + measured.reason;
    return result;
  }
  hints_.clear();
  result.measured = measured;
  if (const int equal = found.hypotheses.front().equal_poses; equal > 1) {
    output_.note(
        event_t::NOTICE, "symmetric-target",
        "the target looks the same in " + std::to_string(equal) +
            " poses found; the one with the smallest rotation from the sensor's axes is reported");
  }
  return result;
}

void Estimator::acquire_far(const LongRangeFix& far, bool was_zoomed, const PreprocessedScan& scan,
                            pose_estimate_t& estimate) {
  estimate.method = far.axis ? "moments" : "centroid";
  if (!far.ok || !was_zoomed) {
    estimate.reason = far.ok ? "a distant object, to be scanned more densely" : far.reason;
    if (!was_zoomed) {
      const auto window =
          window_around(whole_target(model_->radius), {far.pose.position, {}}, field_of_view(),
                        setup_.options.zoom_beams, "something far");
      if (window) zoom_ = {*window};
    }
    fill_filtered(estimate);
    return;
  }
  Matrix6d covariance = far.covariance;
  covariance.topLeftCorner<3, 3>() *=
      4;  // independent samples of the target's surface: the filter's and this scan's
  start_from(far.pose, covariance, scan.utime_mean);
  range_ = OperatingRange::long_range;
  accept_far(far, estimate);
  change_mode(Mode::TRACKING, "tracking");
}

/// Updates the estimate with a scan in long range.
void Estimator::accept_far(const LongRangeFix& far, pose_estimate_t& estimate) {
  coarse_attitude_ = far.pose.rotation;
  systematic_ = far.systematic;
  near_enough_ = ranges_->suited(far.pose.position.norm(), range_) != OperatingRange::long_range;
  failures_ = 0;
  TrackingResult measured;
  measured.pose = far.pose;
  measured.used = far.used;
  measured.confidence =
      std::min(1.0, static_cast<double>(far.used) / setup_.options.ranges.axis_returns);
  fill_measurement(measured, estimate);
  fill_filtered(estimate);
  estimate.status = pose_estimate_t::OK;
  estimate.reason.clear();
}

/// Long range: bearing, range and a coarse axis; once the target is near enough, its pose.
void Estimator::track_far(const PreprocessedScan& scan, pose_estimate_t& estimate,
                          Durations& durations) {
  Prediction predicted{tracker_->predict(estimate.utime),
                       tracker_->predicted_covariance(estimate.utime), tracker_->velocity()};
  // The filter's attitude may have no measurement yet.
  if (largest_sigma(predicted.covariance.bottomRightCorner<3, 3>()) > known_attitude_sigma_rad) {
    predicted.pose.rotation = coarse_attitude_;
  }
  LongRangeFix far = long_range_->track(scan, predicted);
  const Pose position_only{far.pose.position, tracker_->predict(estimate.utime).rotation};
  if (far.ok && !tracker_->update(position_only, far.covariance, estimate.utime)) {
    far.ok = false;
    far.reason = not_filtered;
  }
  if (!far.ok) {
    estimate.method = "centroid";
    estimate.status = pose_estimate_t::LOST;
    estimate.reason = far.reason;
    fill_filtered(estimate);
    count_failure(far.reason);
    return;
  }
  if (near_enough_) {
    const std::int64_t start = setup_.stopwatch();
    const Velocity velocity{tracker_->velocity().linear, Vector3d::Zero()};
    const Found found = find_pose(scan, velocity, estimate);
    durations.acquire = setup_.stopwatch() - start;
    const Matrix3d spread = (far.covariance + far.systematic).topLeftCorner<3, 3>();
    if (found.measured &&
        distance(found.measured->pose, far.pose) < 4 * std::sqrt(spread.trace())) {
      tracker_->start(found.measured->pose, found.measured->covariance, estimate.utime, velocity,
                      tracker_->velocity_covariance());
      range_ = OperatingRange::medium_range;
      failures_ = 0;
      fill_measurement(*found.measured, estimate);
      estimate.status = pose_estimate_t::OK;
      estimate.reason.clear();
      fill_filtered(estimate);
      return;
    }
  }
  estimate.method = far.axis ? "moments" : "centroid";
  accept_far(far, estimate);
}

}  // namespace berth::estimator
