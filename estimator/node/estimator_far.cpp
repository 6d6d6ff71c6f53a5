// SPDX-License-Identifier: BSD-3-Clause
// Long range: the place and a coarse axis, until the pose can be seen.
#include <algorithm>
#include <cmath>

#include "estimator/node/estimator.h"
#include "estimator/node/messages.h"

namespace berth::estimator {

namespace {

// A filter whose attitude is less certain than this does not know it.
constexpr double known_attitude_sigma_rad = 0.5;

}  // namespace

void Estimator::acquire_far(const LongRangeFix& far, bool was_zoomed, const CleanScan& scan,
                            pose_estimate_t& estimate) {
  estimate.method = far.axis ? "moments" : "centroid";
  if (!far.ok || !was_zoomed) {
    estimate.reason = far.ok ? "something is there, to be looked at more closely" : far.reason;
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
      4;  // two draws of the target's surface: the filter's and ours
  start_from(far.pose, covariance, scan.utime_mean);
  range_ = OperatingRange::long_range;
  take_far(far, estimate);
  change_mode(Mode::TRACKING, "tracking");
}

/// What a scan tells in long range goes into the filter and into the estimate.
void Estimator::take_far(const LongRangeFix& far, pose_estimate_t& estimate) {
  far_attitude_ = far.pose.rotation;
  systematic_ = far.systematic;
  within_reach_ = ranges_->suited(far.pose.position.norm(), range_) != OperatingRange::long_range;
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

/// Long range: bearing, range and a coarse axis; and as soon as the target is near enough, its
/// pose.
void Estimator::track_far(const CleanScan& scan, pose_estimate_t& estimate, Durations& durations) {
  Prediction predicted{tracker_->predict(estimate.utime),
                       tracker_->predicted_covariance(estimate.utime), tracker_->velocity()};
  // A filter that was never told of an attitude has nothing to say about it.
  if (largest_sigma(predicted.covariance.bottomRightCorner<3, 3>()) > known_attitude_sigma_rad) {
    predicted.pose.rotation = far_attitude_;
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
  if (within_reach_) {
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
  take_far(far, estimate);
}

}  // namespace berth::estimator
