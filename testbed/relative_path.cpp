// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/relative_path.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {
namespace {

SmoothTravel travel_of(const Vector6d& change, const RelativeLimits& limits) {
  const double distance = change.head<3>().norm();
  const double angle = change.tail<3>().norm();
  const double length = std::max(distance / limits.speed, angle / limits.angular_speed);
  if (length <= 0) return {};
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

/// Cubic Hermite interpolation between 0 and end with the given rates, x in 0..1 over duration.
Vector3d hermite(const Vector3d& end, const Vector3d& rate0, const Vector3d& rate1, double duration,
                 double x) {
  const double x2 = x * x;
  const double x3 = x2 * x;
  return (x3 - 2 * x2 + x) * duration * rate0 + (3 * x2 - 2 * x3) * end +
         (x3 - x2) * duration * rate1;
}

}  // namespace

StraightPath::StraightPath(const Pose& from, const Pose& to, const RelativeLimits& limits)
    : from_(from), change_(difference(from, to)), travel_(travel_of(change_, limits)) {}

RelativePath::Point StraightPath::at(double t) const {
  const double progress = travel_.length() > 0 ? travel_.position(t) / travel_.length() : 1.0;
  return {perturbed(from_, progress * change_), progress};
}

WaypointPath::WaypointPath(std::vector<Waypoint> waypoints) : waypoints_(std::move(waypoints)) {
  velocities_.resize(waypoints_.size());
  for (std::size_t i = 1; i + 1 < waypoints_.size(); ++i) {
    const Waypoint& a = waypoints_[i - 1];
    const Waypoint& b = waypoints_[i + 1];
    // turned as it turns from neighbour to neighbour, by way of the waypoint itself
    const Vector6d before = difference(a.pose, waypoints_[i].pose);
    const Vector6d after = difference(waypoints_[i].pose, b.pose);
    const Vector6d rate = (before + after) / (b.time - a.time);
    velocities_[i] = {rate.head<3>(), rate.tail<3>()};
  }
}

RelativePath::Point WaypointPath::at(double t) const {
  const double clamped = std::clamp(t, 0.0, duration());
  const auto next =
      std::upper_bound(waypoints_.begin() + 1, waypoints_.end() - 1, clamped,
                       [](double time, const Waypoint& waypoint) { return time < waypoint.time; });
  const auto i = static_cast<std::size_t>(next - waypoints_.begin()) - 1;
  const Waypoint& a = waypoints_[i];
  const Waypoint& b = waypoints_[i + 1];
  const double span = b.time - a.time;
  const double x = (clamped - a.time) / span;
  const Vector6d change = difference(a.pose, b.pose);
  const Vector3d phi = change.tail<3>();
  Vector6d step;
  step << hermite(change.head<3>(), velocities_[i].linear, velocities_[i + 1].linear, span, x),
      hermite(phi, velocities_[i].angular, rotation_vector_rate(phi, velocities_[i + 1].angular),
              span, x);
  return {perturbed(a.pose, step), clamped / duration()};
}

}  // namespace berth::testbed
