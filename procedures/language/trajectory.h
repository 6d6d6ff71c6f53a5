// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/config.h"
#include "common/core/pose.h"
#include "procedures/language/key_info.h"

namespace berth::procedures {

/// Through waypoints at their times, open loop.
struct Trajectory {
  struct Waypoint {
    double at = 0;  ///< s after the start
    Pose pose;      ///< T_sensor_model
  };
  std::vector<Waypoint> waypoints;
};

/// Reads the map `trajectory` of a step.
/// @throws InputError "file:line: key ...: found ..., expected ..."
Trajectory read_trajectory(Config& step);

/// The keys that read_trajectory knows, for the schema and the documentation.
const std::vector<KeyInfo>& trajectory_keys();

}  // namespace berth::procedures
