// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "procedures/language/schema.h"
#include "testbed/trajectories/trajectory.h"

namespace berth::procedures {

/// Through waypoints at their times, open loop: written out, from a file, or made by a rule.
struct Trajectory {
  /// From the commanded relative pose as the step begins, T_sensor_model.
  std::function<testbed::Waypoints(const Pose& here)> waypoints;
  double duration = 0;  ///< s; 0: it depends on where it begins
};

/// Reads a map of a step, such as `trajectory`: one rule with its keys.
/// @throws InputError "file:line: key ...: found ..., expected ..."
Trajectory read_trajectory(Config& step, const std::string& key = "trajectory");

/// The rules that read_trajectory knows, for the schema and the documentation.
const std::vector<KeyInfo>& trajectory_keys();

}  // namespace berth::procedures
