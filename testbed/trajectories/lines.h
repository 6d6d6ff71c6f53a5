// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {

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

/// To and fro along one axis about where it begins, as a sine: fast, and without going far.
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

}  // namespace berth::testbed
