// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "testbed/guidance/guidance.h"
#include "testbed/guidance/profile.h"
#include "testbed/motion/clearance.h"
#include "testbed/motion/path_check.h"
#include "testbed/safety/arm_watch.h"
#include "testbed/safety/estimate_watch.h"
#include "testbed/safety/safety.h"
#include "testbed/truth/ground_truth.h"

namespace berth::testbed {

/// Everything in config/testbed.yaml, and the profiles of config/guidance. Times in us, the rest
/// SI.
struct Settings {
  std::int64_t setpoint_period = 16667;
  std::int64_t dead_time = 150000;  ///< nominal, until it is identified from the arms' motion
  std::int64_t setpoint_lifetime = 200000;

  RelativeLimits motion;  ///< speeds where a command names none
  double greatest_speed = 0.5;
  double greatest_angular_speed = 0.52;
  double hold_settling = 0.8;
  double retreat_speed = 0.05;
  double rejoin_speed = 0.035;
  std::int64_t start_time_limit = 5000000;
  std::int64_t planning_budget = 20000000;  ///< of one motion's plan or refusal

  PathLimits path;
  Clearance::Limits clearance;
  Guidance::Settings guidance;
  bool publish_chaser_motion = true;                ///< of the commanded motion, on INERTIAL_MOTION
  std::map<std::string, GuidanceProfile> profiles;  ///< by name
  SafetySupervisor::Settings safety;
  FollowingWatch::Settings following_watch;
  EstimateWatch::Settings estimate_watch;
  double min_clearance = 0.05;  ///< m between bodies of different parties, for arms that move
  std::int64_t lease_lifetime = 2000000;
  GroundTruth::Settings truth;
};

/// @throws InputError.
Settings load_settings(const std::filesystem::path& file);
/// The same, with the values that the cell's layout overrides.
Settings load_settings(const std::filesystem::path& file, const Cell& cell);

}  // namespace berth::testbed
