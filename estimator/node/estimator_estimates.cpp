// SPDX-License-Identifier: BSD-3-Clause
// Estimates of finished scans, and, when streaming, of a tracking scan in progress: every n returns
// the beams so far update a copy of the filter. The filter itself is updated by the whole scan.
#include <algorithm>
#include <berth/event_t.hpp>
#include <cmath>
#include <limits>

#include "common/core/covariance.h"
#include "common/core/text.h"
#include "estimator/node/estimator.h"
#include "estimator/node/messages.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"

namespace berth::estimator {
namespace {

// Of an unknown pose.
constexpr double unknown_sigma_m = 1000;
constexpr double unknown_sigma_rad = radians(180);
// After a pause, in which the target may have moved.
constexpr double resumed_pose_sigma_m = 0.1;
constexpr double resumed_pose_sigma_rad = radians(5);

/// Whether fewer expected returns fit the target than random variation allows, by two standard
/// deviations of a binomial draw: small batches at edges are not inconsistent.
bool is_inconsistent(double fit, double expected) {
  constexpr double share = 0.75;
  return fit < share * expected - 2 * std::sqrt(share * (1 - share) * expected);
}

}  // namespace

pose_estimate_t Estimator::new_estimate(std::int64_t scan_id, const PreprocessedScan& scan) const {
  pose_estimate_t estimate{};
  estimate.session = now_.session;
  estimate.command_seq = now_.command_seq;
  estimate.scan_id = scan_id;
  estimate.utime_first_return = scan.utime_first;
  estimate.utime_last_return = scan.utime_last;
  estimate.utime = scan.utime_mean;
  estimate.target = model_->target.name;
  estimate.target_hash = model_->target.hash;
  estimate.returns_received = scan.received - scan.misses - scan.repeated;
  estimate.misses = scan.misses;
  estimate.operating_range = static_cast<std::int8_t>(range_);
  return estimate;
}

void Estimator::process(const FinishedScan& b) {
  Durations durations;
  std::int64_t start = setup_.stopwatch();
  const PreprocessedScan scan = preprocess(b.beams, now_.gate, setup_.lidar.beam);
  durations.preprocess = setup_.stopwatch() - start;

  pose_estimate_t estimate = new_estimate(b.id, scan);
  estimate.first_packet = b.first_packet;
  estimate.last_packet = b.last_packet;
  estimate.packets_missing = b.packets_missing;
  if (scan.points.empty()) estimate.utime = b.utime;

  double inertial_s = 0;
  if (tracker_->started()) {
    inertial_s = sensor_motions_.propagate(*tracker_, estimate.utime);
    sensor_motions_.forget_before(tracker_->utime());
  }
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
  if (const std::string defect = estimate_defect(estimate);
      estimate.status == pose_estimate_t::OK && !defect.empty()) {
    estimate.status = pose_estimate_t::LOST;
    estimate.reason = "the estimate is not usable: " + defect;
    count_failure(estimate.reason);
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
  if (scan.repeated > 0) {
    d.names.emplace_back("dropped_repeated");
    d.values.push_back(scan.repeated);
  }
  d.names.emplace_back("noise_factor");
  d.values.push_back(noise_.factor());
  if (setup_.options.inertial_motion) {
    d.names.emplace_back("inertial_s");
    d.values.push_back(inertial_s);
  }
  d.value_count = static_cast<std::int32_t>(d.names.size());
  output_.diagnostics(d);
}

/// Measures the scan's pose and updates the noise scale.
TrackingResult Estimator::measure(const PreprocessedScan& scan, const Prediction& predicted) {
  constexpr double explained = 0.85;  // minimum confidence that confirms a new noise scale
  TrackingResult measured = tracking_->track(scan, predicted);
  const NoiseScale before = noise_;
  if (noise_.update(measured.spread, measured.used)) {
    const TrackingResult again = tracking_->track(scan, predicted);
    if (again.ok && again.confidence > explained) {
      measured = again;
      noise_.update(measured.spread, measured.used);
    } else {
      noise_ = before;  // the pose is wrong, not the noise scale
    }
  }
  report_noise();
  const std::string defect = measured.ok ? covariance_defect(measured.covariance) : "";
  if (!defect.empty()) {
    measured.ok = false;
    measured.reason = "the covariance of the measured pose " + defect;
  }
  return measured;
}

/// Reports a noise scale that differs from the specification once, and its end.
void Estimator::report_noise() {
  constexpr double much = 1.5;
  constexpr double little = 1.25;
  const double factor = noise_.factor();
  const double off = std::max(factor, 1 / factor);
  if (noise_reported_ ? off > little : off < much) return;
  noise_reported_ = !noise_reported_;
  output_.note(event_t::NOTICE, "noise-differs",
               noise_reported_ ? "the scatter of the returns is " + fixed(factor, 1) +
                                     " times the LIDAR's specification; covariances include it"
                               : "the scatter of the returns is as the LIDAR's specification");
}

Prediction Estimator::prediction_of(const TargetTracker& tracker, std::int64_t utime) {
  return {tracker.predict(utime), tracker.predicted_covariance(utime), tracker.velocity(),
          tracker.predicted_velocity_covariance(utime)};
}

void Estimator::track(const PreprocessedScan& scan, pose_estimate_t& estimate,
                      Durations& durations) {
  const std::int64_t start = setup_.stopwatch();
  if (range_ == OperatingRange::long_range) {
    track_far(scan, estimate, durations);
    durations.track = setup_.stopwatch() - start - durations.acquire;
    return;
  }
  const std::int64_t utime = estimate.utime;
  TrackingResult measured = measure(scan, prediction_of(*tracker_, utime));
  if (measured.ok) {
    measured.ok = measured.motion ? tracker_->update(measured.pose, measured.covariance,
                                                     *measured.motion, utime)
                                  : tracker_->update(measured.pose, measured.covariance, utime);
    if (!measured.ok) measured.reason = not_filtered;
  }
  // Times of estimates do not decrease after those of the scan in progress.
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
    coarse_attitude_ = tracker_->pose().rotation;
    systematic_.setZero();
    near_enough_ = false;
  } else {
    estimate.status = pose_estimate_t::LOST;
    estimate.reason = measured.reason;
    fill_filtered(estimate);
    count_failure(measured.reason);
  }
  durations.track = setup_.stopwatch() - start;
}

/// Infinite for an invalid covariance.
double Estimator::largest_sigma(const Matrix3d& covariance) {
  if (!is_covariance(covariance)) return std::numeric_limits<double>::infinity();
  return std::sqrt(covariance.diagonal().maxCoeff());
}

Matrix6d Estimator::resumed_covariance() {
  return diagonal_covariance(resumed_pose_sigma_m, resumed_pose_sigma_rad);
}

/// Starts tracking from a pose with zero velocity.
void Estimator::start_from(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) {
  forget_target();
  tracker_->start(pose, covariance, utime);
  failures_ = 0;
  range_ = ranges_->suited((pose * model_->centre).norm(), OperatingRange::medium_range);
  coarse_attitude_ = pose.rotation;
}

void Estimator::forget_target() {
  tracker_->stop();
  hints_.clear();
  zoom_.clear();
  range_ = OperatingRange::medium_range;
  near_enough_ = false;
  systematic_.setZero();
  search_beams_ = setup_.options.acquire_beams;
  zoom_scans_ = searches_ = 0;
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
    set_pose({}, estimate);
    set_covariance(diagonal_covariance(unknown_sigma_m, unknown_sigma_rad), estimate.covariance);
    return;
  }
  // The pose at the estimate's time: the filter's after an update, else its prediction.
  Pose pose = tracker.predict(estimate.utime);
  const bool updated = estimate.utime == tracker.utime();
  Matrix6d covariance =
      updated ? tracker.covariance() : tracker.predicted_covariance(estimate.utime);
  if (range_ == OperatingRange::long_range) {
    // The attitude is the last scan's: the filter's is unknown, or older.
    pose.rotation = coarse_attitude_;
    const Matrix3d position = covariance.topLeftCorner<3, 3>();
    covariance = systematic_;
    covariance.topLeftCorner<3, 3>() += position;
  }
  set_pose(with_positive_w(pose), estimate);
  set_covariance(covariance, estimate.covariance);
  set_covariance(tracker.velocity_covariance(), estimate.velocity_covariance);
  set_velocity(tracker.velocity(), estimate);
  estimate.operating_range = static_cast<std::int8_t>(range_);
}

void Estimator::stream() {
  if (!streams() || now_.mode != estimator_state_t::TRACKING || scan_->own_windows ||
      range_ == OperatingRange::long_range) {
    return;
  }
  if (!stream_) stream_ = Stream{tracker_->clone(), 0, {}, 0, false};
  // In order, whatever the order of arrival: deterministic.
  std::vector<RawBeam> beams;
  for (auto packet = scan_->packets.find(stream_->next_packet);
       packet != scan_->packets.end() && packet->first == stream_->next_packet;
       packet = scan_->packets.find(stream_->next_packet)) {
    beams.clear();
    append_beams(packet->second, beams);
    for (const RawBeam& beam : beams) {
      stream_->beams.push_back(beam);
      stream_->returns += beam.status == BeamStatus::hit ? 1 : 0;
      if (stream_->returns >= setup_.options.estimate_every) track_partial_scan(*stream_);
    }
    ++stream_->next_packet;
  }
}

/// The beams received so far are tracked as one scan: correlated errors count once.
void Estimator::track_partial_scan(Stream& stream) {
  const std::int64_t start = setup_.stopwatch();
  stream.returns = 0;
  const PreprocessedScan scan = preprocess(stream.beams, now_.gate, setup_.lidar.beam);
  if (scan.points.empty()) return;
  const auto tracker = stream.tracker->clone();
  sensor_motions_.propagate(*tracker, scan.utime_mean);
  const TrackingResult measured = tracking_->track(scan, prediction_of(*tracker, scan.utime_mean));
  const double expected = measured.used / std::max(1e-3, measured.confidence);
  stream.inconsistent = stream.inconsistent || is_inconsistent(measured.used, expected);
  if (stream.inconsistent || !measured.ok || !measured.motion ||
      !tracker->update(measured.pose, measured.covariance, *measured.motion, scan.utime_mean)) {
    return;
  }
  pose_estimate_t estimate = new_estimate(scan_->id, scan);
  estimate.utime = scan.utime_last;
  publish_streamed(stream, *tracker, measured, estimate, start);
}

void Estimator::publish_streamed(Stream& stream, const TargetTracker& tracker,
                                 const TrackingResult& measured, pose_estimate_t& estimate,
                                 std::int64_t start) {
  estimate.last_packet = stream.next_packet;
  estimate.method = "stream";
  estimate.status = pose_estimate_t::OK;
  fill_filtered(tracker, estimate);
  if (!is_good(estimate)) {
    stream.inconsistent = true;
    return;
  }
  fill_measurement(measured, estimate);
  estimate.seq = ++estimate_seq_;
  output_.estimate(estimate);

  estimator_diagnostics_t d{};
  d.utime = estimate.utime;
  d.seq = estimate.seq;
  d.session = estimate.session;
  d.scan_id = estimate.scan_id;
  d.track_us = setup_.stopwatch() - start;
  output_.diagnostics(d);
}

}  // namespace berth::estimator
