// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/guidance.h"

#include <algorithm>

#include "common/core/text.h"

namespace berth::testbed {
namespace {

Vector3d at_most(const Vector3d& change, double length) {
  return change.norm() <= length ? change : Vector3d(change.normalized() * length);
}

}  // namespace

double Guidance::surface_distance(const Pose& pose) const {
  const Vector3d sensor = pose.inverse().position;  // in the model frame
  return (target_->nearest(sensor) - sensor).norm();
}

Pose Guidance::reference(double travelled) const {
  Pose pose = reference_start_;
  pose.position += travelled * direction_;
  return pose;
}

double Guidance::distance_to_go(const Pose& pose) const {
  if (docking_) return (pose * docking_->port.pose.position - docking_->place).norm();
  return surface_distance(pose) - standoff_;
}

/// The commanded pose at which the estimate is expected at the reference.
Pose Guidance::uncorrected(const Pose& reference) const { return reference * offset_.inverse(); }

void Guidance::note_target_moved(const Pose& moved) {
  history_ = history_.mapped([&](std::int64_t, const Pose& pose) { return pose * moved; });
}

std::optional<std::int64_t> Guidance::estimate_age(std::int64_t now) const {
  if (!estimate_) return std::nullopt;
  return now - estimate_->utime;
}

std::string Guidance::unusable(std::int64_t now) const {
  if (!estimate_) return "there is no estimate";
  if (!estimate_->usable) return "the estimate is " + estimate_->status;
  const std::int64_t age = now - estimate_->utime;
  if (age > settings_.stale_after) {
    return "the estimate is " + fixed(static_cast<double>(age) * 1e-6, 1) + " s old";
  }
  return "";
}

std::optional<std::string> Guidance::begin(std::int64_t now, const Pose& commanded) {
  const std::string reason = unusable(now);
  if (!reason.empty()) return reason;
  const Pose before = history_.at(estimate_->commanded()).value_or(commanded);
  seen_ = Pose();
  offset_ = seen_ = seen_from(before, *estimate_);
  // the reference begins at the commanded pose, as the estimate measures it
  reference_start_ = commanded * offset_;
  time_ = 0;
  holding_since_ = arrived_ = 0;
  held_ = false;
  good_in_a_row_ = settings_.good_estimates;
  scale_.stop();
  active_ = true;
  return std::nullopt;
}

std::optional<std::string> Guidance::approach(std::int64_t now, const Pose& commanded,
                                              double standoff, const RelativeLimits& limits,
                                              const std::optional<Docking>& docking) {
  active_ = false;
  if (auto reason = begin(now, commanded)) return reason;
  active_ = false;
  docking_ = docking;
  direction_ = -Vector3d::UnitZ();
  standoff_ = standoff;
  keeping_ = false;
  const auto set_off = [&](double length) {
    travel_ = SmoothTravel(length, limits.speed, limits.acceleration,
                           4 * limits.acceleration / limits.rise_time);
    active_ = true;
    return std::nullopt;
  };
  if (docking_) {
    const Vector3d point = reference_start_ * docking_->port.pose.position;
    const Vector3d axis =
        reference_start_.rotation * docking_->port.pose.rotation * Vector3d::UnitZ();
    const double off_axis = std::atan2(axis.cross(-point).norm(), axis.dot(-point));
    if (off_axis > docking_->port.approach_cone) {
      return "by the estimate the sensor is " + fixed(degrees(off_axis), 1) +
             " deg off the axis of docking port '" + docking_->port.name + "', limit " +
             fixed(degrees(docking_->port.approach_cone), 1) + " deg";
    }
    const Vector3d way = docking_->place - point;
    if (way.norm() > 0) direction_ = way.normalized();
    return set_off(way.norm());
  }
  if (surface_distance(reference_start_) < standoff - settings_.settle_tolerance) {
    return "the nearest surface is at " + fixed(surface_distance(reference_start_), 3) +
           " m already, nearer than the standoff of " + fixed(standoff, 3) + " m";
  }
  double low = 0;
  double high = std::max(0.0, reference_start_.position.z());
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (surface_distance(reference(middle)) > standoff ? low : high) = middle;
  }
  return set_off(low);
}

std::optional<std::string> Guidance::keep(std::int64_t now, const Pose& commanded,
                                          const Pose& reference, const RelativeLimits& limits) {
  active_ = false;
  if (auto reason = begin(now, commanded)) return reason;
  active_ = false;
  const Vector6d away = difference(reference_start_, reference);
  if (away.head<3>().norm() > settings_.largest_correction ||
      away.tail<3>().norm() > settings_.largest_angular_correction) {
    return "the estimate is " + fixed(1e3 * away.head<3>().norm(), 0) + " mm and " +
           fixed(degrees(away.tail<3>().norm()), 1) +
           " deg away from the pose to keep; move there first";
  }
  // the difference is removed as a correction is
  reference_start_ = reference;
  offset_ = commanded.inverse() * reference;
  travel_ = SmoothTravel(0, limits.speed, limits.acceleration, limits.acceleration);
  docking_.reset();
  keeping_ = true;
  active_ = true;
  return std::nullopt;
}

void Guidance::continue_as(Guidance begun) {
  begun.estimate_ = std::move(estimate_);
  begun.history_ = std::move(history_);
  begun.override_ = override_;
  *this = std::move(begun);
}

void Guidance::on_estimate(const Estimate& estimate) {
  if (estimate_ && estimate.utime < estimate_->utime) return;
  estimate_ = estimate;
  good_in_a_row_ = estimate.usable ? good_in_a_row_ + 1 : 0;
  if (active_ && estimate.usable) correct(estimate);
}

/// The estimate in the model frame of the commanded pose.
Pose Guidance::seen_from(const Pose& commanded, const Estimate& estimate) const {
  Pose offset = commanded.inverse() * estimate.pose;
  if (!estimate.attitude_known) offset.rotation = seen_.rotation;
  return offset;
}

void Guidance::correct(const Estimate& estimate) {
  const auto before = history_.at(estimate.commanded());
  if (!before) return;
  seen_ = seen_from(*before, estimate);
}

void Guidance::set_held(bool held) {
  if (held_ && !held) holding_since_ = 0;
  held_ = held;
}

void Guidance::stop() {
  active_ = held_ = false;
  scale_.stop();
}

double Guidance::progress() const {
  return travel_.length() > 0 ? travel_.position(time_) / travel_.length() : 0.0;
}

double Guidance::remaining() const { return std::max(0.0, travel_.duration() - time_); }

GuidanceReport Guidance::report() const {
  using Does = GuidanceReport::Phase;
  GuidanceReport report;
  report.law = "kinematic";
  if (!active_) return report;
  const Pose expected = reference(travel_.position(time_));
  report.phase = !reason_.empty() ? Does::holding
                 : keeping_       ? Does::station_keeping
                                  : Does::approaching;
  report.reason = reason_;
  report.range = keeping_ ? surface_distance(expected) : distance_to_go(expected) + standoff_;
  report.reference_closing_speed = travel_.speed(time_);
  report.closing_speed = scale_.rate() * report.reference_closing_speed;
  report.misalignment = angle_between(seen_, offset_);
  report.orbit_time = time_;
  return report;
}

Guidance::Output Guidance::step(std::int64_t now, double dt) {
  Output output;
  std::string reason = unusable(now);
  if (reason.empty() && holding_since_ != 0 && good_in_a_row_ < settings_.good_estimates) {
    reason = "waiting for " + std::to_string(settings_.good_estimates) + " good estimates";
  }
  if (reason.empty()) {
    holding_since_ = 0;
  } else if (holding_since_ == 0) {
    holding_since_ = now;
  }
  reason_ = reason;
  scale_.set_target(reason.empty() && !held_ ? override_ : 0);
  time_ += scale_.advance(dt);
  if (reason.empty() && !held_) {
    Vector6d change = difference(offset_, seen_);
    change.head<3>() = at_most(change.head<3>(), settings_.correction_speed * dt);
    change.tail<3>() = at_most(change.tail<3>(), settings_.correction_angular_speed * dt);
    offset_ = perturbed(offset_, change);
  }
  output.commanded = uncorrected(reference(travel_.position(time_)));
  output.progress = progress();
  note_commanded(now, output.commanded);

  if (!reason.empty()) {
    const bool too_long = now - holding_since_ > settings_.give_up_after;
    output.phase = too_long ? Phase::gave_up : Phase::holding;
    output.reason = reason;
    return output;
  }
  if (keeping_ || time_ < travel_.duration()) return output;
  if (arrived_ == 0) arrived_ = now;
  output.phase = Phase::settling;
  const bool seen = estimate_->commanded() >= arrived_;
  const double error = distance_to_go(estimate_->pose);
  const bool settled = seen && std::abs(error) <= settings_.settle_tolerance;
  if (!settled && now - arrived_ <= settings_.settle_for) return output;
  output.phase = Phase::done;
  if (!settled) {
    output.reason = "the estimate is still " + fixed(1e3 * error, 0) + " mm from the standoff";
  }
  return output;
}

}  // namespace berth::testbed
