// SPDX-License-Identifier: BSD-3-Clause
// What the fold makes of a scan: windows before it, an estimate after it.
#include <algorithm>
#include <berth/event_t.hpp>
#include <cmath>

#include "common/core/text.h"
#include "estimator/acquisition/discriminating_windows.h"
#include "estimator/node/estimator.h"
#include "estimator/node/messages.h"
#include "estimator/scan/at_mean_time.h"

namespace berth::estimator {

namespace {

using Mode = estimator_state_t;

// Of a pose that nobody knows.
constexpr double unknown_sigma_m = 1000;
constexpr double unknown_sigma_rad = radians(180);
// After a pause nobody knows how the target moved.
constexpr double resumed_pose_sigma_m = 0.1;
constexpr double resumed_pose_sigma_rad = radians(5);

// A filter whose attitude is less certain than this does not know it.
constexpr double known_attitude_sigma_rad = 0.5;

double largest_sigma(const Matrix3d& covariance) {
  return std::sqrt(covariance.diagonal().maxCoeff());
}

}  // namespace

FieldOfView Estimator::field_of_view() const {
  return {setup_.lidar.field_of_view_width, setup_.lidar.field_of_view_height,
          setup_.lidar.minimum_step_rad, setup_.lidar.beam};
}

/// About all of a target whose attitude is not known.
ModelSphere Estimator::whole_target(double margin) const {
  return {Vector3d::Zero(), model_->centre.norm() + model_->radius + margin};
}

std::vector<Window> Estimator::plan_windows() {
  const EstimatorOptions& o = setup_.options;
  if (now_.mode == Mode::ACQUIRING) {
    if (!zoom_.empty()) return zoom_;
    return {planner_->everything(search_beams_)};
  }
  if (now_.mode != Mode::TRACKING) return {};
  // A target near enough for its pose is looked at more closely until that is found.
  const bool looking = range_ == OperatingRange::long_range && within_reach_;
  const int beams = looking ? o.zoom_beams : now_.returns_per_scan;
  // The middle of the scan to come.
  const double ahead = o.request_latency_s + 0.5 * beams / setup_.lidar.rate_hz;
  const std::int64_t then =
      std::max(last_input_utime_, tracker_->utime()) + static_cast<std::int64_t>(1e6 * ahead);
  const Pose pose = tracker_->predict(then);
  const Matrix6d covariance = tracker_->predicted_covariance(then);
  const double translation = largest_sigma(covariance.topLeftCorner<3, 3>());
  if (range_ == OperatingRange::long_range) {
    const auto window = window_around(whole_target(o.planner.margin_sigmas * translation), pose,
                                      field_of_view(), beams, "target");
    return window ? std::vector<Window>{*window} : std::vector<Window>{};
  }
  const double rotation = largest_sigma(covariance.bottomRightCorner<3, 3>());
  const double sigma = std::hypot(translation, rotation * model_->canonical.half_length);
  // Windows that have grown to the size of the target find nothing that the whole view does not.
  const double most = 0.3 * model_->canonical.half_length;
  if (range_ == OperatingRange::short_range && docking_) {
    ModelSphere sphere = *docking_;
    sphere.radius += o.planner.margin_sigmas * std::min(sigma, most);
    const auto window = window_around(sphere, pose, field_of_view(), beams, "docking interface");
    if (window) return {*window};
  }
  return planner_->plan(pose, std::min(sigma, most), now_.strategy, beams);
}

// -----------------------------------------------------------------------------------------
// estimates

pose_estimate_t Estimator::blank_estimate(std::int64_t scan_id, const CleanScan& scan) const {
  pose_estimate_t estimate{};
  estimate.session = now_.session;
  estimate.command_seq = now_.command_seq;
  estimate.scan_id = scan_id;
  estimate.utime_first_return = scan.utime_first;
  estimate.utime_last_return = scan.utime_last;
  estimate.utime = scan.utime_mean;
  estimate.target = model_->target.name;
  estimate.target_hash = model_->target.hash;
  estimate.returns_received = scan.received - scan.misses;
  estimate.misses = scan.misses;
  estimate.operating_range = static_cast<std::int8_t>(range_);
  return estimate;
}

void Estimator::process(const Bundle& b) {
  Durations durations;
  std::int64_t start = setup_.stopwatch();
  const CleanScan scan = preprocess(b.beams, now_.gate, setup_.lidar.beam);
  durations.preprocess = setup_.stopwatch() - start;

  pose_estimate_t estimate = blank_estimate(b.id, scan);
  estimate.first_packet = b.first_packet;
  estimate.last_packet = b.last_packet;
  estimate.packets_missing = b.packets_missing;
  if (scan.points.empty()) estimate.utime = b.utime;

  if (now_.mode == Mode::ACQUIRING) {
    acquire(scan, estimate, durations);
  } else if (now_.mode == Mode::TRACKING) {
    track(scan, estimate, durations);
  } else {
    estimate.method = "none";
    estimate.status = pose_estimate_t::IDLE;
    estimate.reason = mode_reason_;
    fill_filtered(estimate);
  }
  if (estimate.status != pose_estimate_t::OK && !b.reason.empty()) {
    estimate.reason += "; the scan: " + b.reason;
  }
  estimate.seq = ++estimate_seq_;
  output_.estimate(estimate);

  estimator_diagnostics_t d{};
  d.utime = estimate.utime;
  d.seq = estimate.seq;
  d.session = estimate.session;
  d.scan_id = estimate.scan_id;
  d.preprocess_us = durations.preprocess;
  d.acquire_us = durations.acquire;
  d.track_us = durations.track;
  d.plan_us = durations.plan;
  const std::pair<const char*, int> values[] = {{"dropped_invalid", scan.invalid},
                                                {"dropped_saturated", scan.saturated},
                                                {"dropped_too_near", scan.too_near},
                                                {"nearer_than_gate", scan.nearer},
                                                {"farther_than_gate", scan.farther}};
  for (const auto& [name, value] : values) {
    d.names.emplace_back(name);
    d.values.push_back(value);
  }
  d.names.emplace_back("noise_factor");
  d.values.push_back(noise_.factor());
  d.value_count = static_cast<std::int32_t>(d.names.size());
  output_.diagnostics(d);
}

/// Where no pose is known: a near target is acquired, of a far one the place is found.
void Estimator::acquire(const CleanScan& scan, pose_estimate_t& estimate, Durations& durations) {
  const std::int64_t start = setup_.stopwatch();
  const bool was_zoomed = !zoom_.empty();
  zoom_.clear();
  noise_.forget();
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
  // Asked for so many returns, a search shows but where to look; the pose is found anew.
  if (found.measured && !was_zoomed && now_.acquire_returns > 0) {
    zoom_ = look_closer(found.measured->pose, margin);
    if (!zoom_.empty()) {
      fill_filtered(estimate);
      estimate.reason = "seen, to be looked at with the returns asked for";
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
  // The next scan looks where the target seems to be; if this one did so already and found nothing,
  // everywhere again.
  std::vector<Pose> open;
  for (const Hypothesis& h : hints_) open.push_back(h.pose);
  std::vector<Window> where;
  if (found.status == AcquisitionResult::Status::ambiguous) {
    // Half of the beams where the hypotheses differ, the rest on all of the target.
    const int beams = setup_.options.zoom_beams;
    where = discriminating_windows(*model_, hints_, field_of_view(), beams / 2);
    const std::vector<Window> all =
        planner_->around(open, margin, where.empty() ? beams : beams / 2);
    where.insert(where.end(), all.begin(), all.end());
  } else if (!was_zoomed && !open.empty()) {
    where = look_closer(open.front(), 3 * margin);
  }
  if (!where.empty()) {
    zoom_ = where;
  } else if (scan.points.empty() && !was_zoomed) {
    search_more_finely();
  }
}

std::vector<Window> Estimator::look_closer(const Pose& pose, double margin) const {
  if (now_.acquire_returns == 0) {
    return planner_->around({pose}, margin, setup_.options.zoom_beams);
  }
  return planner_->outline(pose, margin, now_.acquire_returns);
}

/// Beams so far apart that a target at the end of the range gate fits between them.
void Estimator::search_more_finely() {
  const double area = setup_.lidar.field_of_view_width * setup_.lidar.field_of_view_height;
  const double reach = std::min(now_.gate.far, setup_.lidar.beam.range_max_m);
  const double apart = reach * std::sqrt(area / search_beams_);
  if (apart < 0.5 * model_->radius) return;
  search_beams_ =
      std::min(search_beams_ * setup_.options.ranges.search_growth, setup_.lidar.beams_max);
}

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

/// Acquisition on a scan of a target that may move, and a first measurement of the pose it finds.
/// Keeps what it leaves open as hints for the next one.
Estimator::Found Estimator::find_pose(const CleanScan& scan, const Velocity& velocity,
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
    estimate.reason = "found a pose that does not hold: " + measured.reason;
    return result;
  }
  hints_.clear();
  result.measured = measured;
  if (const int equal = found.hypotheses.front().equal_poses; equal > 1) {
    output_.note(event_t::NOTICE, "symmetric-target",
                 "the target looks the same in " + std::to_string(equal) +
                     " poses found; the one turned least from the sensor's axes is reported");
  }
  return result;
}

/// The scan's pose, and the noise that its returns show.
TrackingResult Estimator::measure(const CleanScan& scan, const Prediction& predicted) {
  constexpr double explained = 0.85;  // of the returns about the target, by a noise never seen yet
  TrackingResult measured = tracking_->track(scan, predicted);
  const NoiseScale before = noise_;
  if (noise_.learn(measured.spread, measured.used)) {
    const TrackingResult again = tracking_->track(scan, predicted);
    if (again.ok && again.confidence > explained) {
      measured = again;
      noise_.learn(measured.spread, measured.used);
    } else {
      noise_ = before;  // not the noise is wrong but the pose
    }
  }
  tell_noise();
  return measured;
}

/// Once, until it is over.
void Estimator::tell_noise() {
  constexpr double much = 1.5;
  constexpr double little = 1.25;
  const double factor = noise_.factor();
  const double off = std::max(factor, 1 / factor);
  if (noise_told_ ? off > little : off < much) return;
  noise_told_ = !noise_told_;
  output_.note(event_t::NOTICE, "noise-differs",
               noise_told_ ? "the returns scatter " + fixed(factor, 1) +
                                 " times what the LIDAR says of itself; covariances say so"
                           : "the returns scatter as the LIDAR says");
}

void Estimator::track(const CleanScan& scan, pose_estimate_t& estimate, Durations& durations) {
  const std::int64_t start = setup_.stopwatch();
  if (range_ == OperatingRange::long_range) {
    track_far(scan, estimate, durations);
    durations.track = setup_.stopwatch() - start - durations.acquire;
    return;
  }
  const std::int64_t utime = estimate.utime;
  TrackingResult measured = measure(
      scan,
      {tracker_->predict(utime), tracker_->predicted_covariance(utime), tracker_->velocity()});
  if (measured.ok) tracker_->update(measured.pose, measured.covariance, utime);
  // The estimates given while the scan ran are not followed by one of an earlier time.
  if (streams()) {
    estimate.utime = std::max(utime, scan.utime_last);
    const double later = static_cast<double>(estimate.utime - utime) * 1e-6;
    measured.pose = moved(measured.pose, tracker_->velocity(), later);
  }
  estimate.method = tracking_->name();
  fill_measurement(measured, estimate);
  if (measured.ok) {
    failures_ = 0;
    estimate.status = pose_estimate_t::OK;
    fill_filtered(estimate);
    range_ = ranges_->suited((tracker_->pose() * model_->centre).norm(), range_);
    far_attitude_ = tracker_->pose().rotation;
    systematic_.setZero();
    within_reach_ = false;
  } else {
    estimate.status = pose_estimate_t::LOST;
    estimate.reason = measured.reason;
    fill_filtered(estimate);
    count_failure(measured.reason);
  }
  durations.track = setup_.stopwatch() - start;
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
  const LongRangeFix far = long_range_->track(scan, predicted);
  if (!far.ok) {
    estimate.method = "centroid";
    estimate.status = pose_estimate_t::LOST;
    estimate.reason = far.reason;
    fill_filtered(estimate);
    count_failure(far.reason);
    return;
  }
  const Pose position_only{far.pose.position, tracker_->predict(estimate.utime).rotation};
  tracker_->update(position_only, far.covariance, estimate.utime);
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

Matrix6d Estimator::resumed_covariance() {
  return diagonal_covariance(resumed_pose_sigma_m, resumed_pose_sigma_rad);
}

/// Tracking begins from a pose, the target at rest.
void Estimator::start_from(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) {
  forget_target();
  tracker_->start(pose, covariance, utime);
  failures_ = 0;
  range_ = ranges_->suited((pose * model_->centre).norm(), OperatingRange::medium_range);
  far_attitude_ = pose.rotation;
}

void Estimator::forget_target() {
  tracker_->stop();
  hints_.clear();
  zoom_.clear();
  range_ = OperatingRange::medium_range;
  within_reach_ = false;
  systematic_.setZero();
  search_beams_ = setup_.options.acquire_beams;
}

void Estimator::count_failure(const std::string& reason) {
  ++failures_;
  if (failures_ < setup_.options.lost_after) return;
  const std::string lost = "lost after " + std::to_string(failures_) + " scans: " + reason;
  failures_ = 0;
  forget_target();
  output_.note(event_t::WARNING, "target-lost", lost);
  if (setup_.options.reacquire && acquisition_->refusal().empty()) {
    change_mode(Mode::ACQUIRING, lost + "; acquiring again");
  } else {
    change_mode(Mode::LOST, lost);
  }
}

void Estimator::fill_filtered(const TargetTracker& tracker, pose_estimate_t& estimate) const {
  if (!tracker.started()) {
    fill_pose({}, estimate.position_m, estimate.q_wxyz);
    fill_matrix(diagonal_covariance(unknown_sigma_m, unknown_sigma_rad), estimate.covariance);
    return;
  }
  // The pose at the estimate's own time: after an update that is the filter's, else a prediction.
  Pose pose = tracker.predict(estimate.utime);
  const bool updated = estimate.utime == tracker.utime();
  Matrix6d covariance =
      updated ? tracker.covariance() : tracker.predicted_covariance(estimate.utime);
  if (range_ == OperatingRange::long_range) {
    // The attitude is the last scan's; the filter knows none, or an old one that went into it.
    pose.rotation = far_attitude_;
    const Matrix3d position = covariance.topLeftCorner<3, 3>();
    covariance = systematic_;
    covariance.topLeftCorner<3, 3>() += position;
  }
  fill_pose(pose, estimate.position_m, estimate.q_wxyz);
  fill_matrix(covariance, estimate.covariance);
  fill_matrix(tracker.velocity_covariance(), estimate.velocity_covariance);
  for (int i = 0; i < 3; ++i) {
    estimate.linear_velocity_m_s[i] = tracker.velocity().linear[i];
    estimate.angular_velocity_rad_s[i] = tracker.velocity().angular[i];
  }
  estimate.operating_range = static_cast<std::int8_t>(range_);
}

}  // namespace berth::estimator
