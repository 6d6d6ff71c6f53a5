// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/guidance/clohessy_wiltshire.h"
#include "testbed/guidance/profile.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// The vector, no longer than `greatest`; its direction is kept.
inline Vector3d shortened(const Vector3d& v, double greatest) {
  const double length = v.norm();
  return length <= greatest ? v : Vector3d(v * (greatest / length));
}

/// The chaser that the cell represents, its sensor at its centre of mass. Frame N: the target's
/// frame at the start of the flight, which moves with the target's origin and does not rotate
/// against the orbit's local vertical. Under the law `clohessy_wiltshire` it moves on its relative
/// orbit, driven by thrusters along its body axes with a minimum impulse; under `kinematic` it
/// follows its commands. Attitude is turned within limits under both. Units of the cell.
class Chaser {
 public:
  /// start: T_N_sensor, at rest against the target.
  Chaser(const GuidanceProfile& profile, const RelativeLimits& limits, const Pose& start);

  /// Flies on for dt seconds. acceleration: total set-point, frame N, m/s^2; clipped to the
  /// thrusters' limit, axis by axis. angular_acceleration: rad/s^2, frame N.
  void step(double dt, const Vector3d& acceleration, const Vector3d& angular_acceleration);
  /// The same with a given thrust, without control.
  void coast(double dt, const Vector3d& thrust_acceleration, const Vector3d& angular_acceleration);

  const Pose& pose() const { return pose_; }              ///< T_N_sensor
  const Velocity& velocity() const { return velocity_; }  ///< frame N
  /// By thrusters, frame N, m/s^2.
  const Vector3d& thrust() const { return thrust_; }
  /// Greatest acceleration along each body axis, m/s^2.
  double max_acceleration() const { return max_acceleration_; }
  const RelativeLimits& limits() const { return limits_; }

  /// Seconds of orbit since the start.
  double orbit_time() const { return orbit_time_; }
  /// By thrusters, sensor frame, m/s^2 of orbit.
  const Vector3d& thrust_orbit() const { return thrust_orbit_; }
  double delta_v_orbit() const { return delta_v_; }  ///< m/s of orbit, all axes together
  double propellant() const { return propellant_; }  ///< kg
  /// Position and velocity in orbit.
  HillState hill() const;
  /// The least burn to a passively safe drift away (retreat.h), m/s, frame N.
  Vector3d safe_burn(double min_speed) const;
  /// A vector of the Hill frame, in frame N.
  Vector3d from_hill(const Vector3d& v) const { return hill_from_n_.conjugate() * v; }

 private:
  Vector3d natural() const;  // acceleration without thrust, frame N, m/s^2
  Vector3d fired(double dt, const Vector3d& requested);
  void push(double dt, const Vector3d& thrust, const Vector3d& angular_acceleration);

  GuidanceProfile::Law law_;
  GuidanceProfile::Orbit orbit_;
  RelativeLimits limits_;
  double max_acceleration_;
  double specific_impulse_;
  double mass_;
  Quaterniond hill_from_n_;
  Pose pose_;
  Velocity velocity_;
  double min_impulse_ = 0;  // m/s of the cell that an axis gives at least at a time
  Vector3d pending_impulse_ = Vector3d::Zero();  // not fired yet, m/s, body axes
  Vector3d burning_impulse_ = Vector3d::Zero();  // left of burns that have begun, m/s, body axes
  Vector3d thrust_ = Vector3d::Zero();           // acceleration, frame N
  Vector3d turning_ = Vector3d::Zero();          // angular acceleration, frame N
  double orbit_time_ = 0;
  Vector3d thrust_orbit_ = Vector3d::Zero();
  double delta_v_ = 0;
  double propellant_ = 0;
};

}  // namespace berth::testbed
