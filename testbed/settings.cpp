// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/settings.h"

#include <cmath>

#include "common/core/positive.h"

namespace berth::testbed {
namespace {

std::int64_t microseconds(Config& config, const std::string& key) {
  return std::llround(1e6 * positive(config, key, Dimension::time));
}

std::int64_t period(Config& config, const std::string& key) {
  return std::llround(1e6 / positive(config, key, Dimension::frequency));
}

/// Every profile of the folder, by name.
std::map<std::string, GuidanceProfile> load_profiles(const std::filesystem::path& folder) {
  std::map<std::string, GuidanceProfile> profiles;
  if (!std::filesystem::is_directory(folder)) return profiles;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    GuidanceProfile profile = load_guidance_profile(entry.path());
    profiles.emplace(profile.name, std::move(profile));
  }
  return profiles;
}

}  // namespace

Settings load_settings(const std::filesystem::path& file) {
  Config config = Config::load(file);
  Settings s;
  config.raw("target");  // a run has its target by name already

  Config setpoints = config.section("setpoints");
  s.setpoint_period = period(setpoints, "rate");
  s.dead_time = microseconds(setpoints, "dead_time");
  s.setpoint_lifetime = microseconds(setpoints, "lifetime");
  setpoints.finish();

  Config motion = config.section("motion");
  s.motion.speed = positive(motion, "speed", Dimension::speed);
  s.motion.angular_speed = positive(motion, "angular_speed", Dimension::angular_speed);
  s.greatest_speed = positive(motion, "greatest_speed", Dimension::speed);
  s.greatest_angular_speed = positive(motion, "greatest_angular_speed", Dimension::angular_speed);
  s.motion.acceleration = positive(motion, "acceleration", Dimension::acceleration);
  s.motion.angular_acceleration =
      positive(motion, "angular_acceleration", Dimension::angular_acceleration);
  s.motion.rise_time = positive(motion, "rise_time", Dimension::time);
  s.hold_settling = positive(motion, "hold_settling", Dimension::time);
  s.retreat_speed = positive(motion, "retreat_speed", Dimension::speed);
  s.rejoin_speed = positive(motion, "rejoin_speed", Dimension::angular_speed);
  s.start_time_limit = microseconds(motion, "start_time_limit");
  if (motion.has("planning_budget")) s.planning_budget = microseconds(motion, "planning_budget");
  motion.finish();

  Config path = config.section("path_check");
  s.path.rates.speed = positive(path, "joint_speed", Dimension::number);
  s.path.rates.acceleration = positive(path, "joint_acceleration", Dimension::number);
  s.path.rates.rise_time = positive(path, "joint_rise_time", Dimension::time);
  s.path.rates.hold_settling = s.hold_settling;
  s.path.manipulability = positive(path, "manipulability", Dimension::number);
  s.path.sample_time = positive(path, "sample_time", Dimension::time);
  s.clearance.between = positive(path, "clearance", Dimension::length);
  s.clearance.within = positive(path, "own_clearance", Dimension::length);
  path.finish();

  Config guidance = config.section("guidance");
  s.guidance.hold_settling = s.hold_settling;
  s.guidance.stale_after = microseconds(guidance, "stale_after");
  s.guidance.give_up_after = microseconds(guidance, "give_up_after");
  s.guidance.settle_for = microseconds(guidance, "settle_for");
  s.guidance.settle_tolerance = positive(guidance, "settle_tolerance", Dimension::length);
  s.guidance.good_estimates = guidance.small_integer("good_estimates");
  s.guidance.correction_speed = positive(guidance, "correction_speed", Dimension::speed);
  s.guidance.correction_angular_speed =
      positive(guidance, "correction_angular_speed", Dimension::angular_speed);
  s.guidance.largest_correction = positive(guidance, "largest_correction", Dimension::length);
  guidance.optional("largest_correction_share", s.guidance.largest_correction_share);
  s.guidance.largest_angular_correction =
      positive(guidance, "largest_angular_correction", Dimension::angle);
  guidance.optional("inertial_motion", s.tell_chaser_motion);
  guidance.finish();
  s.profiles = load_profiles(file.parent_path() / "guidance");

  Config safety = config.section("safety");
  s.safety.arm_silence = microseconds(safety, "arm_silence");
  s.safety.heartbeat_silence = microseconds(safety, "heartbeat_silence");
  s.safety.facility_silence = microseconds(safety, "facility_silence");
  s.safety.scan_silence = microseconds(safety, "scan_silence");
  s.safety.watched_nodes = safety.texts("watched_nodes");
  s.safety.watched_in_closed_loop = safety.texts("watched_in_closed_loop");
  s.following_watch.largest_lag = positive(safety, "largest_lag", Dimension::angle);
  s.following_watch.largest_linear_lag = positive(safety, "largest_linear_lag", Dimension::length);
  s.following_watch.max_dead_time = microseconds(safety, "max_dead_time");
  s.estimate_watch.margin = positive(safety, "largest_estimate_error", Dimension::length);
  s.estimate_watch.margin_share =
      positive(safety, "largest_estimate_error_share", Dimension::number);
  s.min_clearance = positive(safety, "min_clearance", Dimension::length);
  s.lease_lifetime = microseconds(safety, "lease_lifetime");
  safety.finish();

  Config truth = config.section("ground_truth");
  s.truth.period = period(truth, "rate");
  s.truth.largest_gap = microseconds(truth, "largest_gap");
  s.truth.velocity_window = microseconds(truth, "velocity_window");
  truth.finish();

  config.finish();
  return s;
}

Settings load_settings(const std::filesystem::path& file, const Cell& cell) {
  Settings settings = load_settings(file);
  if (cell.greatest_speed > 0) settings.greatest_speed = cell.greatest_speed;
  return settings;
}

}  // namespace berth::testbed
