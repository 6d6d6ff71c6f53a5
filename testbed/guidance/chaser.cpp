// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/chaser.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "testbed/guidance/clohessy_wiltshire.h"

namespace berth::testbed {
namespace {

using Law = GuidanceProfile::Law;

constexpr double standard_gravity = 9.80665;  // m/s^2, of the definition of specific impulse

/// How the sensor's axes lie in orbit at the start: the boresight along the bar. On a V-bar y
/// (down) looks to the Earth; on an R-bar, coming from below, x looks along the velocity.
Quaterniond hill_from_sensor(GuidanceProfile::Bar bar) {
  Matrix3d axes;
  if (bar == GuidanceProfile::Bar::v_bar) {
    axes << 0, -1, 0, 0, 0, 1, -1, 0, 0;
  } else {
    axes << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  }
  return Quaterniond(axes);
}

}  // namespace

Chaser::Chaser(const GuidanceProfile& profile, const RelativeLimits& limits, const Pose& start)
    : law_(profile.law),
      orbit_(profile.orbit),
      limits_(limits),
      max_acceleration_(limits.acceleration),
      specific_impulse_(profile.vehicle.specific_impulse),
      mass_(profile.vehicle.mass),
      hill_from_n_(hill_from_sensor(profile.orbit.bar) * start.rotation.conjugate()),
      pose_(start) {
  if (law_ == Law::clohessy_wiltshire) {
    const double of_orbit = profile.vehicle.thrust / profile.vehicle.mass;
    const double scale = orbit_.time_scale * orbit_.time_scale / orbit_.length_scale;
    max_acceleration_ = std::min(of_orbit * scale, limits.acceleration);
    min_impulse_ = of_orbit * scale * profile.vehicle.shortest_burn / orbit_.time_scale;
  }
}

HillState Chaser::hill() const {
  return {orbit_.length_scale * (hill_from_n_ * pose_.position),
          orbit_.length_scale / orbit_.time_scale * (hill_from_n_ * velocity_.linear)};
}

Vector3d Chaser::natural() const {
  if (law_ == Law::kinematic) return Vector3d::Zero();
  const double scale = orbit_.time_scale * orbit_.time_scale / orbit_.length_scale;
  return scale * from_hill(relative_gravity(hill(), orbit_.mean_motion));
}

Vector3d Chaser::safe_burn(double min_speed) const {
  const double scale = orbit_.length_scale / orbit_.time_scale;
  const Vector3d burn = passively_safe_burn(hill(), orbit_.mean_motion, scale * min_speed,
                                            scale / orbit_.time_scale * max_acceleration_);
  return from_hill(burn) / scale;
}

void Chaser::step(double dt, const Vector3d& acceleration, const Vector3d& angular_acceleration) {
  coast(dt, acceleration - natural(), angular_acceleration);
}

void Chaser::coast(double dt, const Vector3d& thrust, const Vector3d& angular_acceleration) {
  if (dt <= 0) return;
  Vector3d requested = thrust;
  if (law_ == Law::kinematic) {
    requested = shortened(thrust, max_acceleration_);
  } else {
    const Vector3d body = pose_.rotation.conjugate() * thrust;
    requested =
        pose_.rotation * fired(dt, body.cwiseMax(-max_acceleration_).cwiseMin(max_acceleration_));
  }
  // neither thrusters nor arms change their acceleration at once
  const double share = 1 - std::exp(-3 * dt / limits_.rise_time);
  thrust_ += share * (requested - thrust_);
  turning_ += share * (shortened(angular_acceleration, limits_.angular_acceleration) - turning_);
  push(dt, thrust_, turning_);
}

/// Acceleration that the thrusters deliver: each axis accumulates the requested impulse up to its
/// minimum impulse, then fires all of it.
Vector3d Chaser::fired(double dt, const Vector3d& requested) {
  pending_impulse_ += dt * requested;
  Vector3d given;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(pending_impulse_[axis]) >= min_impulse_)
      burning_impulse_[axis] += std::exchange(pending_impulse_[axis], 0);
    given[axis] = std::clamp(burning_impulse_[axis] / dt, -max_acceleration_, max_acceleration_);
  }
  burning_impulse_ -= dt * given;
  return given;
}

void Chaser::push(double dt, const Vector3d& thrust, const Vector3d& angular_acceleration) {
  if (law_ == Law::kinematic) {
    pose_.position += dt * velocity_.linear + 0.5 * dt * dt * thrust;
    velocity_.linear += dt * thrust;
    orbit_time_ += dt;
  } else {
    const double scale = orbit_.length_scale / (orbit_.time_scale * orbit_.time_scale);
    const Vector3d orbit_thrust = scale * thrust;
    const double orbit_dt = orbit_.time_scale * dt;
    const HillState next =
        propagated(hill(), hill_from_n_ * orbit_thrust, orbit_.mean_motion, orbit_dt);
    pose_.position = from_hill(next.position) / orbit_.length_scale;
    velocity_.linear = from_hill(next.velocity) * orbit_.time_scale / orbit_.length_scale;
    thrust_orbit_ = pose_.rotation.conjugate() * orbit_thrust;
    const double used = thrust_orbit_.lpNorm<1>() * orbit_dt;
    delta_v_ += used;
    propellant_ += mass_ * used / (specific_impulse_ * standard_gravity);
    orbit_time_ += orbit_dt;
  }
  const Vector3d before = velocity_.angular;
  velocity_.angular += dt * angular_acceleration;
  velocity_.angular = shortened(velocity_.angular, limits_.angular_speed);
  pose_.rotation =
      (rotation_from_vector(0.5 * dt * (before + velocity_.angular)) * pose_.rotation).normalized();
}

}  // namespace berth::testbed
