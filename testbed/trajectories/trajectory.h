// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "testbed/motion/motion_profile.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// A relative motion as a command carries it: T_sensor_model at times, from rest to rest.
using Waypoints = std::vector<WaypointPath::Waypoint>;

/// What one message can carry (64 bytes each, 60 kB).
inline constexpr std::size_t max_waypoints = 900;

/// Where the replica is, t seconds after the start: T_sensor_model. Smooth, and at rest at both
/// ends, or WaypointPath and the arms would have to jump.
using Motion = std::function<Pose(double t)>;

/// The motion at even times, 50 ms apart, or farther where that were too many for one message.
/// @param duration s; nothing above 0: one waypoint, with which no command goes anywhere
Waypoints sampled(const Motion& motion, double duration);

/// Travel over a length (m or rad) that reaches the speed and leaves it within `ramp` seconds each;
/// slower where the length is too short for that.
SmoothTravel eased(double length, double speed, double ramp);

/// Time that runs from 0 to a duration, at full rate but for the ramps: brings a motion that is
/// under way at its first instant from rest and to rest. It lasts `ramp` seconds longer.
inline SmoothTravel eased_time(double duration, double ramp) { return eased(duration, 1, ramp); }

}  // namespace berth::testbed
