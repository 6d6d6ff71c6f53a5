// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/node/command_planner.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "lcmtypes/conversions.h"
#include "testbed/guidance/external_guidance.h"
#include "testbed/guidance/forecast.h"

namespace berth::testbed {
namespace {

/// A constant relative pose as a path without end, for steered motions, which have no planned path.
class HeldPath final : public RelativePath {
 public:
  explicit HeldPath(const Pose& pose) : pose_(pose) {}
  double duration() const override { return 0; }
  Point at(double) const override { return {pose_, 0}; }

 private:
  Pose pose_;
};

/// The command's waypoints as a path from `start`, or why they are invalid. what: for messages.
std::variant<std::shared_ptr<const WaypointPath>, std::string> waypoint_path(
    const std::vector<waypoint_t>& list, const Pose& start, const std::string& what,
    const std::string& beginning) {
  std::vector<WaypointPath::Waypoint> waypoints;
  for (const waypoint_t& waypoint : list) {
    const std::string name = "waypoint " + std::to_string(waypoints.size() + 1);
    if (!is_pose(waypoint.position_m, waypoint.q_wxyz)) return name + " is not a pose";
    const Pose pose = pose_of(waypoint);
    if (waypoints.empty() && waypoint.time_s > 0) waypoints.push_back({0, start});
    if (!(waypoint.time_s >= 0) ||
        (!waypoints.empty() && waypoint.time_s <= waypoints.back().time)) {
      return name + " is not later than the one before";
    }
    if (waypoints.empty()) {
      constexpr double near_m = 0.005;
      constexpr double near_rad = 0.01;
      if (distance(start, pose) > near_m || angle_between(start, pose) > near_rad) {
        return what + " begins " + fixed(1e3 * distance(start, pose), 0) + " mm and " +
               fixed(degrees(angle_between(start, pose)), 1) + " deg away from " + beginning;
      }
      waypoints.push_back({0, start});
    } else {
      waypoints.push_back({waypoint.time_s, pose});
    }
  }
  if (waypoints.size() < 2) return what + " needs a waypoint with a time above 0";
  return std::make_shared<const WaypointPath>(std::move(waypoints));
}

/// The same command at a part of its speed, which is rounded down to what a person would type.
testbed_command2_t slower(testbed_command2_t command, const RelativeLimits& limits, double rate) {
  constexpr double linear = 1e-4;        // m/s
  const double angular = radians(0.01);  // rad/s
  command.speed_m_s = linear * std::max(1.0, std::floor(rate * limits.speed / linear));
  command.angular_speed_rad_s =
      angular * std::max(1.0, std::floor(rate * limits.angular_speed / angular));
  // In a closed loop they are the target's own motion, which no speed of ours changes.
  if (command.command == testbed_command2_t::TRAJECTORY) {
    for (waypoint_t& waypoint : command.waypoints) waypoint.time_s /= rate;
  }
  return command;
}

}  // namespace

bool is_motion(const testbed_command2_t& command) {
  return command.command >= testbed_command2_t::MOVE &&
         command.command <= testbed_command2_t::GUIDED;
}

bool is_closed_loop(const testbed_command2_t& command) {
  return command.command == testbed_command2_t::APPROACH ||
         command.command == testbed_command2_t::STATION_KEEP ||
         command.command == testbed_command2_t::GUIDED;
}

std::string CommandPlanner::limits_of(const testbed_command2_t& command,
                                      RelativeLimits& limits) const {
  limits = settings_.motion;
  if (command.speed_m_s != 0) limits.speed = command.speed_m_s;
  if (command.angular_speed_rad_s != 0) limits.angular_speed = command.angular_speed_rad_s;
  if (!(limits.speed > 0 && limits.speed <= settings_.greatest_speed)) {
    return "a speed of " + fixed(1e3 * limits.speed, 1) + " mm/s is not within 0 to " +
           fixed(1e3 * settings_.greatest_speed, 0) + " mm/s";
  }
  if (!(limits.angular_speed > 0 && limits.angular_speed <= settings_.greatest_angular_speed)) {
    return "an angular speed of " + fixed(degrees(limits.angular_speed), 1) +
           " deg/s is not within 0 to " + fixed(degrees(settings_.greatest_angular_speed), 0) +
           " deg/s";
  }
  return "";
}

std::variant<std::shared_ptr<const ArmMotion>, std::string> CommandPlanner::way_back(
    const testbed_command2_t& command, const TrajectoryHistory& history, const PathCheck& check,
    const ArmPair& start) const {
  if (history.empty()) return "there is no way back: nothing has moved since the last retreat";
  RelativeLimits limits;
  testbed_command2_t with_speed = command;
  if (with_speed.speed_m_s == 0) with_speed.speed_m_s = settings_.retreat_speed;
  std::string wrong = limits_of(with_speed, limits);
  if (!wrong.empty()) return wrong;
  auto motion = history.way_back(start, limits);
  if (const auto refusal = check.check(*motion, start)) return refusal->text;
  return motion;
}

CommandPlanner::Result CommandPlanner::plan(const testbed_command2_t& command, const ArmPair& start,
                                            std::int64_t now, const Guidance& given) const {
  if (command.frozen_arm < 0 || command.frozen_arm > 2) {
    return "frozen_arm is " + std::to_string(command.frozen_arm) +
           ", expected 0 (none), 1 (replica) or 2 (sensor)";
  }
  const Pose from = cell_.relative_pose(start.replica, start.sensor);
  Plan plan;
  Guidance guidance = given;
  const Path path = path_of(command, from, now, guidance, plan);
  if (const auto* wrong = std::get_if<std::string>(&path)) return *wrong;
  MotionPlanner::Result result = planner_.plan(std::get<std::shared_ptr<const RelativePath>>(path),
                                               start, static_cast<FrozenArm>(command.frozen_arm));
  if (auto* arms = std::get_if<MotionPlanner::Plan>(&result)) {
    plan.arms = std::move(*arms);
    if (is_closed_loop(command) && !plan.steering) plan.guidance = std::move(guidance);
    return plan;
  }
  const auto& refusal = std::get<Refusal>(result);
  return refusal.text + passing_speed(command, start, now, guidance, refusal.passing_rate);
}

CommandPlanner::Path CommandPlanner::path_of(const testbed_command2_t& command, const Pose& from,
                                             std::int64_t now, Guidance& guidance,
                                             Plan& plan) const {
  if (is_closed_loop(command)) return closed_loop(command, from, now, guidance, plan);
  return command.command == testbed_command2_t::MOVE ? move(command, from)
                                                     : trajectory(command, from);
}

std::string CommandPlanner::passing_speed(const testbed_command2_t& command, const ArmPair& start,
                                          std::int64_t now, Guidance& guidance, double rate) const {
  RelativeLimits limits;
  if (!(rate > 0) || !limits_of(command, limits).empty()) return "";
  const Pose from = cell_.relative_pose(start.replica, start.sensor);
  constexpr int max_plans = 12;
  constexpr double fine = 0.02;
  double passing = 0;
  double failing = 1;
  for (int i = 0; i < max_plans && failing - passing > fine * failing; ++i) {
    Plan plan;
    const Path path = path_of(slower(command, limits, rate), from, now, guidance, plan);
    const auto* slow = std::get_if<std::shared_ptr<const RelativePath>>(&path);
    if (slow == nullptr) break;
    const auto result = planner_.plan(*slow, start, static_cast<FrozenArm>(command.frozen_arm));
    const auto* refusal = std::get_if<Refusal>(&result);
    (refusal == nullptr ? passing : failing) = rate;
    rate = passing > 0 ? 0.5 * (passing + failing)
                       : failing * std::clamp(refusal->passing_rate, 0.3, 0.9);
  }
  if (passing <= 0) return "";
  std::string text =
      "; it passes at " + fixed(std::floor(1e3 * passing) / 10, 1) + " % of the requested speed";
  if (command.command == testbed_command2_t::TRAJECTORY) {
    text += ", all its times " + fixed(std::ceil(1e3 / passing) / 1e3, 3) +
            " times as long, those of ramps too";
  } else {
    const testbed_command2_t passes = slower(command, limits, passing);
    text += ", " + fixed(1e3 * passes.speed_m_s, 1) + " mm/s and " +
            fixed(degrees(passes.angular_speed_rad_s), 2) + " deg/s";
  }
  return text;
}

CommandPlanner::Path CommandPlanner::move(const testbed_command2_t& command,
                                          const Pose& from) const {
  if (!is_pose(command.position_m, command.q_wxyz)) return "the goal is not a pose";
  RelativeLimits limits;
  const std::string wrong = limits_of(command, limits);
  if (!wrong.empty()) return wrong;
  return std::make_shared<const StraightPath>(from, pose_of(command), limits);
}

CommandPlanner::Path CommandPlanner::trajectory(const testbed_command2_t& command,
                                                const Pose& from) const {
  auto path = waypoint_path(command.waypoints, from, "the trajectory",
                            "where the arms are: move there first");
  if (auto* wrong = std::get_if<std::string>(&path)) return std::move(*wrong);
  return std::get<std::shared_ptr<const WaypointPath>>(path);
}

CommandPlanner::Path CommandPlanner::closed_loop(const testbed_command2_t& command,
                                                 const Pose& commanded, std::int64_t now,
                                                 Guidance& guidance, Plan& plan) const {
  RelativeLimits limits;
  const std::string wrong = limits_of(command, limits);
  if (!wrong.empty()) return wrong;
  if (!command.waypoints.empty()) {
    auto motion =
        waypoint_path(command.waypoints, Pose{}, "the target's own motion", "where the target is");
    if (auto* bad = std::get_if<std::string>(&motion)) return std::move(*bad);
    plan.target_motion = std::get<std::shared_ptr<const WaypointPath>>(std::move(motion));
  }
  const auto with_motion = [&](std::shared_ptr<const RelativePath> path) -> Path {
    if (!plan.target_motion) return path;
    return std::make_shared<const MovingTargetPath>(std::move(path), plan.target_motion);
  };
  if (command.command == testbed_command2_t::GUIDED) {
    plan.steering = std::make_shared<ExternalFlight>(
        command.guidance.empty() ? command.commander : command.guidance, limits, commanded);
    return with_motion(std::make_shared<const HeldPath>(commanded));
  }
  const bool keep = command.command == testbed_command2_t::STATION_KEEP;
  if (!keep && !(command.standoff_m > 0)) return "the standoff must be positive";
  if (!command.guidance.empty()) return flight(command, commanded, now, guidance, limits, plan);
  if (keep) {
    if (!is_pose(command.position_m, command.q_wxyz)) return "the pose to keep is not a pose";
    if (const auto reason = guidance.keep(now, commanded, pose_of(command), limits)) return *reason;
    return with_motion(std::make_shared<const HeldPath>(commanded));
  }
  std::optional<Docking> docking;
  if (command.dock != 0) {
    const DockingPort* port = cell_.target.port(command.port);
    if (port == nullptr) return no_port(command.port);
    docking = {*port, Vector3d(0, 0, command.standoff_m)};
  }
  if (const auto reason = guidance.approach(now, commanded, command.standoff_m, limits, docking)) {
    return *reason;
  }
  return with_motion(
      std::make_shared<const StraightPath>(commanded, guidance.predicted_end(), limits));
}

std::string CommandPlanner::no_port(const std::string& name) const {
  std::vector<std::string> names;
  for (const DockingPort& port : cell_.target.ports) names.push_back(port.name);
  return "target '" + cell_.target.name + "' has no docking port" +
         (name.empty() ? ""
                       : " '" + name + "'; it has " + (names.empty() ? "none" : joined(names)));
}

CommandPlanner::Path CommandPlanner::flight(const testbed_command2_t& command,
                                            const Pose& commanded, std::int64_t now,
                                            const Guidance& guidance, const RelativeLimits& limits,
                                            Plan& plan) const {
  const auto profile = settings_.profiles.find(command.guidance);
  if (profile == settings_.profiles.end()) {
    std::vector<std::string> names;
    for (const auto& [name, other] : settings_.profiles) names.push_back(name);
    return "config/guidance has no '" + command.guidance + "'; it has " + joined(names);
  }
  Flight::Order order;
  order.limits = limits;
  if (command.command == testbed_command2_t::STATION_KEEP) {
    if (!is_pose(command.position_m, command.q_wxyz)) return "the pose to keep is not a pose";
    order.keep = true;
    order.pose = pose_of(command);
  } else {
    order.standoff = command.standoff_m;
    order.dock = command.dock != 0;
  }
  ApproachTarget target{&surface_};
  if (const DockingPort* port = cell_.target.port(command.port)) {
    target.port = *port;
  } else if (order.dock) {
    return no_port(command.port);
  }
  auto begun = Flight::begin(profile->second, target, settings_.guidance, order, now, commanded,
                             guidance.history(), guidance.estimate());
  if (auto* reason = std::get_if<std::string>(&begun)) return std::move(*reason);
  auto steering = std::get<std::shared_ptr<Flight>>(std::move(begun));
  auto path = forecast(*steering, plan.target_motion, now, guidance.estimate()->dead_time);
  if (auto* reason = std::get_if<std::string>(&path)) return std::move(*reason);
  auto flown = std::get<std::shared_ptr<const RelativePath>>(std::move(path));
  steering->expect(flown->duration());
  plan.steering = std::move(steering);
  return flown;
}

}  // namespace berth::testbed
