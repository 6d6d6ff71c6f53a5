// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "testbed/motion/motion_profile.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// A relative motion as a command carries it: T_sensor_model at times, from rest to rest.
using Waypoints = std::vector<WaypointPath::Waypoint>;

/// Capacity of one message (64 bytes each, 60 kB).
inline constexpr std::size_t max_waypoints = 900;

/// Where the replica is, t seconds after the start: T_sensor_model. Smooth, and at rest at both
/// ends, or WaypointPath and the arms would have to jump.
using Motion = std::function<Pose(double t)>;

/// The motion sampled every 50 ms, or less often where one message could not hold that many.
/// @param duration s; not above 0: one waypoint, which is no motion
Waypoints sampled(const Motion& motion, double duration);

/// Travel over a length (m or rad) that reaches the speed and leaves it within `ramp` seconds each;
/// slower where the length is too short for that.
SmoothTravel eased(double length, double speed, double ramp);

/// Time that runs from 0 to a duration, at full rate but for the ramps: brings a motion that is
/// under way at its first instant from rest and to rest. It lasts `ramp` seconds longer.
inline SmoothTravel eased_time(double duration, double ramp) { return eased(duration, 1, ramp); }

/// Straight on by a displacement: position along the sensor's axes, attitude turned about the
/// replica's origin (and the sensor's axes), both over the same time.
struct Straight {
  Pose by;
  double speed = 0.05;           ///< m/s
  double angular_speed = 0.087;  ///< rad/s
  double ramp = 2;               ///< s from rest to full speed
};
Waypoints straight(const Pose& from, const Straight& options);

/// An approach along the line of sight as rendezvous vehicles fly it: legs with hold points between
/// them, x, y and attitude kept. A forced motion is straight; one that coasts from one hold point
/// to the next bulges out of the line, along R-bar on a V-bar approach and along V-bar on an R-bar
/// approach (Fehse, Automated Rendezvous and Docking of Spacecraft, 3.2).
struct BarApproach {
  double to = 0;              ///< m: z of the replica's origin at the end
  std::vector<double> holds;  ///< m: z of the hold points, in order
  double hold_for = 10;       ///< s at each
  double speed = 0.03;        ///< m/s
  double bulge = 0;           ///< m out of the line, half way between two hold points
  Vector3d bulge_along = Vector3d::UnitY();  ///< unit, sensor frame: y is down, to the Earth
  double ramp = 2;                           ///< s
};
Waypoints bar_approach(const Pose& from, const BarApproach& options);

/// Sinusoidal motion to and fro along one axis about the start: fast, within a short range.
struct Oscillation {
  Vector3d axis = Vector3d::UnitX();  ///< sensor frame
  double amplitude = 0.1;             ///< m to either side
  double speed = 0.2;                 ///< m/s at the middle, the greatest
  int cycles = 4;                     ///< to one side, to the other and back
  double ramp = 2;                    ///< s
};
Waypoints oscillation(const Pose& from, const Oscillation& options);

/// Outwards on an Archimedean spiral across the boresight, at constant speed; attitude kept.
struct Spiral {
  double radius = 0.2;  ///< m at the end
  double turns = 2;
  double speed = 0.05;  ///< m/s
  double ramp = 2;      ///< s
};
Waypoints spiral(const Pose& from, const Spiral& options);

/// The slow wandering of a vehicle inside its dead band: each axis on a sine of its own period,
/// none a multiple of another.
struct Drift {
  double amplitude = 0.02;  ///< m per axis
  double turn = 0.0175;     ///< rad about each axis
  double period = 20;       ///< s, of the fastest axis
  double duration = 60;     ///< s
  double ramp = 4;          ///< s
};
Waypoints drift(const Pose& from, const Drift& options);

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
