// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/motion_command.h"

#include "lcmtypes/conversions.h"

namespace berth::procedures {

namespace {

/// Rates at which a closed loop turns, and at which it keeps a pose.
constexpr double turn = radians(5.0);
constexpr double keeping_speed = 0.05;

void set_waypoints(const testbed::Waypoints& waypoints, testbed_command2_t& command) {
  for (const auto& w : waypoints) {
    waypoint_t waypoint{};
    waypoint.time_s = w.time;
    set_pose(w.pose, waypoint);
    command.waypoints.push_back(waypoint);
  }
  command.waypoint_count = static_cast<std::int32_t>(command.waypoints.size());
}

/// The target's own motion begins in the frame that the model has at the start.
void set_target_motion(const std::optional<Trajectory>& motion, testbed_command2_t& command) {
  if (motion) set_waypoints(motion->waypoints(Pose{}), command);
}

struct Maker {
  const Pose& here;

  std::optional<testbed_command2_t> operator()(const Move& move) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::MOVE);
    set_pose(move.to, command);
    command.speed_m_s = move.speed;
    command.angular_speed_rad_s = move.angular_speed;
    command.frozen_arm = static_cast<std::int8_t>(move.frozen_arm);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Retreat& retreat) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::RETREAT);
    command.speed_m_s = retreat.speed;
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Trajectory& trajectory) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::TRAJECTORY);
    set_waypoints(trajectory.waypoints(here), command);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Approach& approach) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::APPROACH);
    command.standoff_m = approach.standoff;
    command.dock = approach.port ? 1 : 0;
    command.port = approach.port.value_or("");
    command.speed_m_s = approach.speed;
    command.angular_speed_rad_s = turn;
    command.guidance = approach.loop.guidance;
    set_target_motion(approach.loop.target_motion, command);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Hold& hold) const {
    if (!hold.closed_loop) return std::nullopt;
    testbed_command2_t command = testbed_command_of(testbed_command2_t::STATION_KEEP);
    set_pose(here, command);
    command.speed_m_s = keeping_speed;
    command.angular_speed_rad_s = turn;
    command.guidance = hold.loop.guidance;
    set_target_motion(hold.loop.target_motion, command);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Guided& guided) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::GUIDED);
    command.speed_m_s = guided.speed;
    command.angular_speed_rad_s = guided.angular_speed;
    command.guidance = guided.by;
    set_target_motion(guided.target_motion, command);
    return command;
  }

  template <class Other>
  std::optional<testbed_command2_t> operator()(const Other&) const {
    return std::nullopt;
  }
};

}  // namespace

testbed_command2_t testbed_command_of(std::int8_t what) {
  testbed_command2_t command{};
  command.command = what;
  set_pose({}, command);
  return command;
}

std::optional<testbed_command2_t> motion_command(const Verb& verb, const Pose& here) {
  return std::visit(Maker{here}, verb);
}

}  // namespace berth::procedures
