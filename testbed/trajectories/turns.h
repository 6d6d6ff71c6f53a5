// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {

/// A chaser flies around its target at constant range, always looking at it: in the sensor frame
/// the replica stays where it is and turns about its own origin.
struct FlyAround {
  double angle = 0;                   ///< rad, right-handed about the axis; may be negative
  Vector3d axis = Vector3d::UnitY();  ///< sensor frame
  double speed = 0.035;               ///< rad/s
  double ramp = 2;                    ///< s
};
Waypoints fly_around(const Pose& from, const FlyAround& options);

/// A rigid body that nothing acts upon: Euler's equations, I w' = -w x I w, in its principal axes,
/// which are the model's; fourth-order Runge-Kutta steps.
class TorqueFreeBody {
 public:
  /// @param inertia about the principal axes, kg m^2; only ratios matter to the motion
  /// @param rate rad/s, in the body's axes
  TorqueFreeBody(const Quaterniond& attitude, const Vector3d& inertia, const Vector3d& rate)
      : attitude_(attitude), inertia_(inertia), rate_(rate) {}

  void advance(double dt);

  const Quaterniond& attitude() const { return attitude_; }
  const Vector3d& rate() const { return rate_; }
  /// Twice the kinetic energy, J.
  double energy() const { return rate_.dot(inertia_.cwiseProduct(rate_)); }
  /// Angular momentum in the outer frame, N m s.
  Vector3d momentum() const { return attitude_ * inertia_.cwiseProduct(rate_); }

 private:
  void step(double dt);

  Quaterniond attitude_;
  Vector3d inertia_;
  Vector3d rate_;
};

/// Free tumbling about the replica's origin.
struct Tumble {
  Vector3d inertia = Vector3d::Ones();  ///< kg m^2, about the model's axes
  Vector3d rate = Vector3d::Zero();     ///< rad/s at the start, about the model's axes
  double duration = 30;                 ///< s
  double ramp = 2;                      ///< s
};
Waypoints tumble(const Pose& from, const Tumble& options);

}  // namespace berth::testbed
