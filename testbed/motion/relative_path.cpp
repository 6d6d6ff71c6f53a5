// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/relative_path.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {
namespace {

SmoothTravel travel_of(const Vector6d& change, const RelativeLimits& limits) {
  const double distance = change.head<3>().norm();
  const double angle = change.tail<3>().norm();
  // Below the accuracy of the kinematics: counts as no motion.
  constexpr double nothing = 1e-9;  // m, rad
  if (distance < nothing && angle < nothing) return {};
  const double length = std::max(distance / limits.speed, angle / limits.angular_speed);
  // in the unit of full speed, translation and rotation share one acceleration
  double acceleration = 1e9;
  if (distance > 0) acceleration = std::min(acceleration, limits.acceleration * length / distance);
  if (angle > 0) {
    acceleration = std::min(acceleration, limits.angular_acceleration * length / angle);
  }
  return {length, 1.0, acceleration, 4 * acceleration / limits.rise_time};
}

/// d rotation_vector / d angular velocity: maps a left angular velocity at Exp(phi) to phi's rate.
Vector3d rotation_vector_rate(const Vector3d& phi, const Vector3d& angular_velocity) {
  const double angle = phi.norm();
  double factor = 1.0 / 12;
  if (angle > 1e-4) {
    factor = (1 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  }
  const Vector3d cross = phi.cross(angular_velocity);
  return angular_velocity - 0.5 * cross + factor * phi.cross(cross);
}

/// Value and derivatives of a coordinate at one end of an interval.
struct End {
  Vector3d position;
  Vector3d rate;
  Vector3d acceleration;
};

/// Quintic Hermite interpolation from one end to the other, x in 0..1 over duration.
Vector3d quintic(const End& a, const End& b, double duration, double x) {
  const Vector3d c1 = duration * a.rate;
  const Vector3d c2 = 0.5 * duration * duration * a.acceleration;
  const Vector3d p = b.position - a.position - c1 - c2;
  const Vector3d v = duration * b.rate - c1 - 2 * c2;
  const Vector3d w = 0.5 * duration * duration * b.acceleration - c2;
  return a.position +
         x * (c1 + x * (c2 + x * (10 * p - 4 * v + w +
                                  x * (-15 * p + 7 * v - 2 * w + x * (6 * p - 3 * v + w)))));
}

/// Rotation vector's second derivative at Exp(phi), for a left angular velocity and acceleration.
Vector3d rotation_vector_acceleration(const Vector3d& phi, const Velocity& velocity,
                                      const Velocity& acceleration) {
  constexpr double h = 1e-4;  // s
  const Vector3d rate = rotation_vector_rate(phi, velocity.angular);
  return rotation_vector_rate(phi, acceleration.angular) +
         (rotation_vector_rate(phi + h * rate, velocity.angular) -
          rotation_vector_rate(phi - h * rate, velocity.angular)) /
             (2 * h);
}

/// From 0 to 1 with no velocity and no acceleration at either end.
double eased_share(double x) { return x * x * x * (10 - x * (15 - 6 * x)); }

}  // namespace

StraightPath::StraightPath(const Pose& from, const Pose& to, const RelativeLimits& limits)
    : from_(from), change_(difference(from, to)), travel_(travel_of(change_, limits)) {}

RelativePath::Point StraightPath::at(double t) const {
  const double progress = travel_.length() > 0 ? travel_.position(t) / travel_.length() : 1.0;
  return {perturbed(from_, progress * change_), progress};
}

WaypointPath::WaypointPath(std::vector<Waypoint> waypoints, Ends ends)
    : waypoints_(std::move(waypoints)), rates_(waypoints_.size()) {
  for (std::size_t i = 1; i + 1 < waypoints_.size(); ++i) {
    const Waypoint& here = waypoints_[i];
    const double before = here.time - waypoints_[i - 1].time;
    const double after = waypoints_[i + 1].time - here.time;
    // of the parabola through the neighbours, by way of the waypoint itself
    const Vector6d arriving = difference(waypoints_[i - 1].pose, here.pose) / before;
    const Vector6d leaving = difference(here.pose, waypoints_[i + 1].pose) / after;
    const Vector6d velocity = (after * arriving + before * leaving) / (before + after);
    const Vector6d acceleration = 2 * (leaving - arriving) / (before + after);
    rates_[i] = {{velocity.head<3>(), velocity.tail<3>()},
                 {acceleration.head<3>(), acceleration.tail<3>()}};
  }
  if (ends == Ends::at_rest) return;
  const auto velocity_from = [this](std::size_t i) {
    return velocity_between(waypoints_[i].pose, waypoints_[i + 1].pose,
                            waypoints_[i + 1].time - waypoints_[i].time);
  };
  rates_.front().velocity = velocity_from(0);
  rates_.back().velocity = velocity_from(waypoints_.size() - 2);
}

RelativePath::Point WaypointPath::at(double t) const {
  const double clamped = std::clamp(t, 0.0, duration());
  const auto next =
      std::upper_bound(waypoints_.begin() + 1, waypoints_.end() - 1, clamped,
                       [](double time, const Waypoint& waypoint) { return time < waypoint.time; });
  const auto i = static_cast<std::size_t>(next - waypoints_.begin()) - 1;
  const Waypoint& a = waypoints_[i];
  const Waypoint& b = waypoints_[i + 1];
  const Rates& from = rates_[i];
  const Rates& to = rates_[i + 1];
  const double span = b.time - a.time;
  const double x = (clamped - a.time) / span;
  const Vector6d change = difference(a.pose, b.pose);
  const Vector3d none = Vector3d::Zero();
  const Vector3d phi = change.tail<3>();
  Vector6d step;
  step << quintic({none, from.velocity.linear, from.acceleration.linear},
                  {change.head<3>(), to.velocity.linear, to.acceleration.linear}, span, x),
      quintic({none, from.velocity.angular, from.acceleration.angular},
              {phi, rotation_vector_rate(phi, to.velocity.angular),
               rotation_vector_acceleration(phi, to.velocity, to.acceleration)},
              span, x);
  return {perturbed(a.pose, step), eased_share(clamped / duration())};
}

}  // namespace berth::testbed
