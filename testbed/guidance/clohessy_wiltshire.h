// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth::testbed {

/// A chaser near a target on a circular orbit, in the target's Hill frame: x radial, away from the
/// Earth; y along the velocity (V-bar); z along the orbit's momentum. m and m/s.
struct HillState {
  Vector3d position = Vector3d::Zero();
  Vector3d velocity = Vector3d::Zero();
};

/// rad/s on a circular orbit around the Earth, altitude in m above its mean equatorial radius.
double mean_motion(double altitude);

/// Acceleration of a chaser without thrust, m/s^2 (Clohessy and Wiltshire 1960):
/// x'' = 3 n^2 x + 2 n y', y'' = -2 n x', z'' = -n^2 z.
Vector3d relative_gravity(const HillState& state, double mean_motion);

/// The state dt seconds later under a constant acceleration by thrusters (m/s^2); exact.
HillState propagated(const HillState& state, const Vector3d& acceleration, double mean_motion,
                     double dt);

/// The least burn after which a chaser drifts away under Clohessy-Wiltshire and, left alone, never
/// comes nearer to the target's origin than where the burn ends. Searched among velocities away
/// from the target (26 directions, a few speeds), each flown in full: burnt with the thrust there
/// is, then free for two orbits.
/// @param state of the chaser, Hill frame, orbit's units
/// @param min_speed m/s away from the target at the burn's end
/// @param max_acceleration m/s^2 along each axis
/// @return the change of velocity, Hill frame, m/s
Vector3d passively_safe_burn(const HillState& state, double mean_motion, double min_speed,
                             double max_acceleration);

}  // namespace berth::testbed
