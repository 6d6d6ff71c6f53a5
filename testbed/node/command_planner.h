// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/testbed_command2_t.hpp>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "testbed/guidance/forecast.h"
#include "testbed/guidance/guidance.h"
#include "testbed/guidance/steering.h"
#include "testbed/motion/motion_planner.h"
#include "testbed/motion/trajectory_history.h"
#include "testbed/settings.h"

namespace berth::testbed {

/// Turns a TESTBED_COMMAND that moves the arms into a checked motion, or into the sentence that
/// refuses it. Used by the testbed node before a motion, and by `berth check`. Planning takes up to
/// seconds: path_check's clearance must not be used by other threads meanwhile.
class CommandPlanner {
 public:
  /// surface: of the target, model frame. All must outlive this.
  CommandPlanner(const Cell& cell, const Settings& settings, const MotionPlanner& planner,
                 const RayCaster& surface)
      : cell_(cell), settings_(settings), planner_(planner), surface_(surface) {}

  struct Plan {
    MotionPlanner::Plan arms;
    std::shared_ptr<Steering> steering;  ///< closed loop by other than the testbed's own guidance
    std::optional<Guidance> guidance;    ///< closed loop by the testbed's own guidance, begun
    TargetMotion target_motion;          ///< closed loop
  };
  using Result = std::variant<Plan, std::string>;

  /// Any motion, from the arms' present joints. Closed loops by the testbed's own guidance begin in
  /// a copy of it; those by a profile are flown to their end first, with perfect estimates. Their
  /// motion is the one predicted.
  /// @param now us, on guidance's clock
  Result plan(const testbed_command2_t& command, const ArmPair& start, std::int64_t now,
              const Guidance& guidance) const;

  /// A retreat along the trajectory history, or why there is none.
  std::variant<std::shared_ptr<const ArmMotion>, std::string> way_back(
      const testbed_command2_t& command, const TrajectoryHistory& history, const PathCheck& check,
      const ArmPair& start) const;

  /// The rates that the command requests. @return why they are refused; empty: they are not.
  std::string limits_of(const testbed_command2_t& command, RelativeLimits& limits) const;

 private:
  /// Refusal of an unknown docking port.
  std::string no_port(const std::string& name) const;
  using Path = std::variant<std::shared_ptr<const RelativePath>, std::string>;

  /// The path that the command requests, or why there is none.
  Path path_of(const testbed_command2_t& command, const Pose& from, std::int64_t now,
               Guidance& guidance, Plan& plan) const;
  /// Names the speed at which the refused command would pass; empty where there is none.
  std::string passing_speed(const testbed_command2_t& command, const ArmPair& start,
                            std::int64_t now, Guidance& guidance, double rate) const;
  Path move(const testbed_command2_t& command, const Pose& from) const;
  Path trajectory(const testbed_command2_t& command, const Pose& from) const;
  Path closed_loop(const testbed_command2_t& command, const Pose& commanded, std::int64_t now,
                   Guidance& guidance, Plan& plan) const;
  Path flight(const testbed_command2_t& command, const Pose& commanded, std::int64_t now,
              const Guidance& guidance, const RelativeLimits& limits, Plan& plan) const;

  const Cell& cell_;
  const Settings& settings_;
  const MotionPlanner& planner_;
  const RayCaster& surface_;
};

/// Whether the command is one of those that plan() takes.
bool is_motion(const testbed_command2_t& command);
/// APPROACH, STATION_KEEP and GUIDED.
bool is_closed_loop(const testbed_command2_t& command);

}  // namespace berth::testbed
