// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/guidance/clohessy_wiltshire.h"

namespace berth::testbed {

/// The least burn after which a chaser drifts away under Clohessy-Wiltshire and, left alone, never
/// comes nearer to the target's origin than where the burn ends. Looked for among
/// velocities away from the target (26 directions, a few speeds), each flown in full: burnt with
/// the thrust there is, then free for two orbits.
/// @param state of the chaser, Hill frame, orbit's units
/// @param min_speed m/s away from the target at the burn's end
/// @param greatest_acceleration m/s^2 along each axis
/// @return the change of velocity, Hill frame, m/s
Vector3d passively_safe_burn(const HillState& state, double mean_motion, double min_speed,
                             double greatest_acceleration);

}  // namespace berth::testbed
