// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/flight.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "testbed/guidance/chaser.h"

namespace berth::testbed {
namespace {

/// Of the greatest acceleration, for speeding up and braking along the corridor.
constexpr double along_share = 0.4;
/// Near enough to a stop, m, and slow enough there, m/s.
constexpr double at_stop = 0.02;
constexpr double slow = 0.003;
/// us of commands over which the chaser's own velocity is averaged.
constexpr std::int64_t chaser_velocity_over = 100000;

/// Acceleration that takes an offset away within about `response`, with braking in time.
Vector3d correction(const Vector3d& offset, const Vector3d& reference_rate, const Vector3d& rate,
                    double response, double speed, double acceleration) {
  const double length = offset.norm();
  const double greatest = std::min(speed, std::sqrt(acceleration * length));
  const Vector3d reference = reference_rate + shortened(offset / response, greatest);
  return 4 / response * (reference - rate);
}

std::string mm(double m) { return fixed(1e3 * m, 0) + " mm"; }
std::string deg(double rad) { return fixed(degrees(rad), 1) + " deg"; }

/// Rises from 0 to 1 without a step in speed.
double smooth(double x) {
  const double s = std::clamp(x, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

}  // namespace

Flight::Result Flight::begin(const GuidanceProfile& profile, const ApproachTarget& target,
                             const Guidance::Settings& settings, const Order& order,
                             std::int64_t now, const Pose& commanded, const PoseHistory& before,
                             const std::optional<Estimate>& estimate) {
  if (!estimate) return "there is no estimate";
  if ((order.dock || profile.align == GuidanceProfile::Align::docking_axis) && !target.port) {
    return "the target has no docking port";
  }
  std::shared_ptr<Flight> flight(
      new Flight(profile, target, settings, order, now, commanded, before, *estimate));
  flight->good_in_a_row_ = settings.good_estimates;
  std::string reason = flight->interruption(now);
  if (reason.empty()) reason = flight->refusal();
  if (!reason.empty()) return reason;
  flight->update_report(flight->first_target_pose_);
  return flight;
}

Flight::Flight(const GuidanceProfile& profile, const ApproachTarget& target,
               const Guidance::Settings& settings, const Order& order, std::int64_t now,
               const Pose& commanded, const PoseHistory& before, const Estimate& estimate)
    : profile_(profile),
      settings_(settings),
      order_(order),
      chaser_(profile, order.limits, commanded.inverse()),
      commands_([&] {
        auto history = before.mapped([now](std::int64_t utime, const Pose& pose) {
          return Command{1e-6 * static_cast<double>(utime - now), pose.inverse()};
        });
        history.add(now, {0, commanded.inverse()});
        return history;
      }()),
      estimate_(estimate),
      target_state_(target_state(estimate, nullptr)),
      first_target_pose_(target_state_.at(0)),
      axis_(target, profile.align, order.dock, chaser_.pose(), first_target_pose_) {
  if (order_.keep) {
    along_ = axis_.keep(first_target_pose_ * order_.pose.inverse(), first_target_pose_);
    place_ = axis_.place(chaser_.pose(), first_target_pose_);
    phase_ = Phase::station_keeping;
    return;
  }
  place_ = axis_.place(chaser_.pose(), first_target_pose_);
  along_ = std::hypot(place_.along, place_.offset);
  for (const GuidanceProfile::HoldPoint& point : profile_.hold_points) {
    if (point.range > place_.range - at_stop) {
      ++passed_stops_;
    } else if (point.range > order_.standoff + at_stop) {
      stops_.push_back(point);
    }
  }
  stops_.push_back({order_.standoff, 0});
}

std::string Flight::refusal() const {
  if (order_.keep) {
    const double limit = settings_.correction_limit(estimate_.pose);
    const Pose reference = first_target_pose_ * order_.pose.inverse();
    const double off = distance(reference, chaser_.pose());
    const double turned = angle_between(reference, chaser_.pose());
    if (off > limit || turned > settings_.largest_angular_correction) {
      return "the estimate is " + mm(off) + " and " + deg(turned) +
             " away from the pose to keep; move there first";
    }
    return "";
  }
  if (place_.range < order_.standoff - settings_.settle_tolerance) {
    return "the target is at " + fixed(place_.range, 3) +
           " m already, nearer than the standoff of " + fixed(order_.standoff, 3) + " m";
  }
  const double off_axis = std::atan2(place_.offset, place_.along);
  if (const double cone = axis_.approach_cone(); off_axis > cone) {
    return "by the estimate the sensor is " + deg(off_axis) + " off the docking axis, limit " +
           deg(cone);
  }
  return "";
}

/// The estimate in frame N, referred to the command that was executed at the time of the scan.
/// @param last its attitude and velocity are kept where the estimate has none
Flight::TargetState Flight::target_state(const Estimate& estimate, const TargetState* last) const {
  const std::int64_t until = estimate.commanded();
  const Command before = *commands_.at(until - chaser_velocity_over);
  const Command command = *commands_.at(until);
  TargetState target_state{command.time, command.pose * estimate.pose,
                           last ? last->velocity : Velocity{}};
  const double flown = command.time - before.time;
  const double slowed = flown / (1e-6 * static_cast<double>(chaser_velocity_over));
  // While the flight is held, its time runs slowly: the velocity is kept.
  if (estimate.velocity && slowed > 0.5) {
    const Velocity chaser = velocity_between(before.pose, command.pose, flown);
    const Quaterniond& turned = command.pose.rotation;
    target_state.velocity = {chaser.linear + chaser.angular.cross(turned * estimate.pose.position) +
                                 turned * estimate.velocity->linear / slowed,
                             chaser.angular + turned * estimate.velocity->angular / slowed};
  }
  if (!estimate.attitude_known && last) {
    target_state.pose.rotation = last->at(target_state.time).rotation;
    target_state.velocity.angular = last->velocity.angular;
  }
  return target_state;
}

void Flight::on_estimate(const Estimate& estimate) {
  if (estimate.utime < estimate_.utime) return;
  estimate_ = estimate;
  good_in_a_row_ = estimate.usable ? good_in_a_row_ + 1 : 0;
  if (!estimate.usable) return;
  const TargetState seen = target_state(estimate, &target_state_);
  const Vector6d away = difference(target_state_.at(seen.time), seen.pose);
  const double limit = settings_.correction_limit(estimate.pose);
  if (away.head<3>().norm() > limit ||
      away.tail<3>().norm() > settings_.largest_angular_correction) {
    rejection_ = "the estimate is " + mm(away.head<3>().norm()) + " and " +
                 deg(away.tail<3>().norm()) + " away from where the target was expected";
    good_in_a_row_ = 0;
    return;
  }
  rejection_.clear();
  target_state_ = seen;
}

std::string Flight::interruption(std::int64_t now) const {
  if (!estimate_.usable) return "the estimate is " + estimate_.status;
  const std::int64_t age = now - estimate_.utime;
  if (age > settings_.stale_after) {
    return "the estimate is " + fixed(static_cast<double>(age) * 1e-6, 1) + " s old";
  }
  if (!rejection_.empty()) return rejection_;
  if (interrupted_for_ > 0 && good_in_a_row_ < settings_.good_estimates) {
    return "waiting for " + std::to_string(settings_.good_estimates) + " good estimates";
  }
  return "";
}

Steering::Output Flight::step(std::int64_t now, double dt) {
  time_ += dt;
  const Pose model = target_state_.at(time_);
  if (phase_ == Phase::retreating) {
    retreat(dt);
  } else {
    update_phase(now, dt, model);
    if (phase_ != Phase::retreating) fly(dt, model);
  }
  commands_.add(now, {time_, chaser_.pose()});
  update_report(model);
  Output output;
  output.commanded = chaser_.pose().inverse();
  output.reason = reason_;
  output.progress = expected_ > 0 ? smooth(time_ / expected_) : 0;
  output.phase = aborted_                   ? Steering::Phase::aborted
                 : done_                    ? Steering::Phase::done
                 : phase_ == Phase::holding ? Steering::Phase::holding
                                            : Steering::Phase::flying;
  return output;
}

/// Decides the phase and the reference closing speed of the next dt.
void Flight::update_phase(std::int64_t now, double dt, const Pose& model) {
  place_ = axis_.place(chaser_.pose(), model);
  const auto reference = axis_.reference(model, {}, along_, 0, 0);
  misalignment_ = angle_between(reference.pose, chaser_.pose());
  corridor_ = order_.keep ? -1
                          : profile_.corridor.radius +
                                place_.range * std::tan(profile_.corridor.half_angle);
  reason_ = interruption(now);
  if (!reason_.empty()) {
    interrupted_for_ += dt;
    const bool too_near = !order_.keep && place_.range < profile_.final.range;
    if (interrupted_for_ > profile_.abort.after || (too_near && dt > 0))
      return start_retreat(reason_);
    phase_ = Phase::holding;
    const double brake = along_share * chaser_.max_acceleration() * dt;
    closing_ = closing_ > 0 ? std::max(0.0, closing_ - brake) : std::min(0.0, closing_ + brake);
    closing_rate_ = 0;
    along_ -= closing_ * dt;
    return;
  }
  interrupted_for_ = 0;
  if (order_.keep) {
    phase_ = Phase::station_keeping;
    return;
  }
  if (in_corridor_ && place_.offset > corridor_) {
    return start_retreat("the chaser is " + mm(place_.offset) + " off the axis, the corridor's " +
                         "half width is " + mm(corridor_));
  }
  proceed(dt);
}

/// m/s along the axis at so many m before the next stop.
double Flight::reference_closing(double to_go) const {
  const double acceleration = along_share * chaser_.max_acceleration();
  const double distance = std::abs(to_go);
  double speed = std::min({order_.limits.speed, std::sqrt(2 * acceleration * distance),
                           distance / profile_.tracking.response});
  const double before_final = std::max(0.0, place_.range - profile_.final.range);
  speed = std::min(speed, std::sqrt(profile_.final.speed * profile_.final.speed +
                                    2 * acceleration * before_final));
  return std::copysign(speed, to_go);
}

/// Advances along the axis, as far as the next stop and the conditions allow.
void Flight::proceed(double dt) {
  const GuidanceProfile::GoOn& go_on = profile_.go_on;
  phase_ = place_.range < profile_.final.range ? Phase::final : Phase::approaching;
  double reference = 0;
  double to_go = 0;
  if (!in_corridor_) {
    in_corridor_ = place_.offset < 0.5 * corridor_ && misalignment_ < go_on.angle;
    waiting_ += dt;
    if (waiting_ > go_on.patience) {
      return start_retreat("the corridor was not reached within " + fixed(go_on.patience, 0) +
                           " s: " + mm(place_.offset) + " and " + deg(misalignment_) + " off");
    }
    if (in_corridor_) waiting_ = 0;
  } else {
    to_go = place_.range - stops_.front().range + along_ - place_.along;
    reference = reference_closing(to_go);
  }
  const double step = along_share * chaser_.max_acceleration() * dt;
  const double change = std::clamp(reference - closing_, -step, step);
  closing_rate_ = dt > 0 ? change / dt : 0;
  closing_ += change;
  along_ -= closing_ * dt;
  if (!in_corridor_ || std::abs(to_go) > at_stop || std::abs(closing_) > slow) return;
  if (stops_.size() > 1) {
    wait_at_hold_point(dt);
  } else {
    settle();
  }
}

void Flight::wait_at_hold_point(double dt) {
  const GuidanceProfile::GoOn& go_on = profile_.go_on;
  phase_ = Phase::at_hold_point;
  waiting_ += dt;
  const bool fits = place_.offset <= go_on.offset && misalignment_ <= go_on.angle;
  dwelt_ = fits ? dwelt_ + dt : 0;
  if (dwelt_ >= stops_.front().dwell) {
    stops_.erase(stops_.begin());
    ++passed_stops_;
    waiting_ = dwelt_ = 0;
  } else if (waiting_ > go_on.patience + stops_.front().dwell) {
    start_retreat("at the hold point at " + fixed(stops_.front().range, 2) +
                  " m: " + mm(place_.offset) + " and " + deg(misalignment_) +
                  " off, go-on limits " + mm(go_on.offset) + " and " + deg(go_on.angle));
  }
}

/// Waits at the end for an estimate made there that agrees.
void Flight::settle() {
  if (order_.dock) phase_ = Phase::contact;
  if (!arrived_) arrived_ = time_;
  const double error = place_.range - order_.standoff;
  const bool agrees = commands_.at(estimate_.commanded())->time >= *arrived_ &&
                      std::abs(error) <= settings_.settle_tolerance;
  const bool too_long = time_ - *arrived_ > 1e-6 * static_cast<double>(settings_.settle_for);
  if (!agrees && !too_long) return;
  done_ = true;
  if (!agrees) reason_ = "the estimate is still " + mm(error) + " from the standoff";
}

void Flight::fly(double dt, const Pose& model) {
  const auto reference =
      axis_.reference(model, target_state_.velocity, along_, -closing_, -closing_rate_);
  const GuidanceProfile::Tracking& tracking = profile_.tracking;
  const Velocity& velocity = chaser_.velocity();
  const Vector3d acceleration =
      reference.acceleration +
      correction(reference.pose.position - chaser_.pose().position, reference.velocity.linear,
                 velocity.linear, tracking.response, tracking.speed, chaser_.max_acceleration());
  const RelativeLimits& limits = chaser_.limits();
  const Vector3d turn =
      rotation_vector(reference.pose.rotation * chaser_.pose().rotation.conjugate());
  const Vector3d turning =
      correction(turn, reference.velocity.angular, velocity.angular, tracking.response,
                 limits.angular_speed, limits.angular_acceleration);
  chaser_.step(dt, acceleration, turning);
}

void Flight::start_retreat(const std::string& reason) {
  phase_ = Phase::retreating;
  reason_ = reason;
  retreat_model_ = target_state_.at(time_);
  retreat_out_ = (chaser_.pose().position - retreat_model_.position).normalized();
  retreat_time_ = 0;
  closing_ = closing_rate_ = 0;
  burn_ = profile_.law == GuidanceProfile::Law::kinematic
              ? Vector3d(profile_.abort.retreat_speed * retreat_out_ - chaser_.velocity().linear)
              : chaser_.safe_burn(profile_.abort.retreat_speed);
}

/// Burns, then drifts, by the state at its begin; later estimates are not used.
void Flight::retreat(double dt) {
  retreat_time_ += dt;
  place_ = axis_.place(chaser_.pose(), retreat_model_);
  const double response = chaser_.limits().rise_time;
  const Vector3d turning = -4 / profile_.tracking.response * chaser_.velocity().angular;
  chaser_.coast(dt, burn_ / response, turning);
  burn_ -= dt * chaser_.thrust();
  if (place_.range > profile_.abort.retreat_range || retreat_time_ > profile_.abort.retreat_time) {
    aborted_ = true;
  }
}

void Flight::update_report(const Pose& model) {
  const Pose& target = phase_ == Phase::retreating ? retreat_model_ : model;
  const auto rest = axis_.reference(
      target, phase_ == Phase::retreating ? Velocity{} : target_state_.velocity, along_, 0, 0);
  report_.profile = profile_.name;
  report_.law = name_of(profile_.law);
  report_.phase = phase_;
  report_.reason = reason_;
  report_.length_scale = profile_.orbit.length_scale;
  report_.time_scale = profile_.orbit.time_scale;
  report_.orbit_time = chaser_.orbit_time();
  report_.range = place_.range;
  report_.closing_speed =
      -axis_.direction(target).dot(chaser_.velocity().linear - rest.velocity.linear);
  report_.reference_closing_speed = closing_;
  report_.corridor_offset = place_.offset;
  report_.corridor_limit = corridor_;
  report_.misalignment = misalignment_;
  report_.hold_point = stops_.size() > 1 ? passed_stops_ : -1;
  report_.acceleration_orbit = chaser_.thrust_orbit();
  report_.delta_v_orbit = chaser_.delta_v_orbit();
  report_.propellant = chaser_.propellant();
}

}  // namespace berth::testbed
