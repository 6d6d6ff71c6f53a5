// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/trajectory.h"

namespace berth::procedures {

const std::vector<KeyInfo>& trajectory_keys() {
  static const std::vector<KeyInfo> keys = {
      {"waypoints", Kind::waypoints, true, "", "a list of {at: TIME, pose: [x, y, z, w, p, r]}"},
  };
  return keys;
}

Trajectory read_trajectory(Config& step) {
  Config config = step.section("trajectory");
  Trajectory trajectory;
  for (Config& section : config.sections("waypoints")) {
    Trajectory::Waypoint waypoint;
    waypoint.at = section.quantity("at", Dimension::time);
    waypoint.pose = section.pose("pose");
    section.finish();
    if (!trajectory.waypoints.empty() && waypoint.at <= trajectory.waypoints.back().at) {
      throw section.error("at", "must be later than the waypoint before");
    }
    trajectory.waypoints.push_back(waypoint);
  }
  if (trajectory.waypoints.empty()) throw config.error("waypoints", "expected at least one");
  config.finish();
  return trajectory;
}

}  // namespace berth::procedures
