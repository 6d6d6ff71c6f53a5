// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/settings.h"

#include <cmath>

#include "common/core/config.h"

namespace berth::testbed {
namespace {

std::int64_t period(Config& config, const std::string& key) {
  return std::llround(1e6 / config.quantity(key, Dimension::frequency, above(0)));
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
  config.raw("target");  // the run's setup names the target

  Config setpoints = config.section("setpoints");
  s.setpoint_period = period(setpoints, "rate");
  s.dead_time = setpoints.microseconds("dead_time", above(0));
  s.setpoint_lifetime = setpoints.microseconds("lifetime", above(0));
  setpoints.finish();

  Config motion = config.section("motion");
  s.motion.speed = motion.quantity("speed", Dimension::speed, above(0));
  s.motion.angular_speed = motion.quantity("angular_speed", Dimension::angular_speed, above(0));
  s.greatest_speed = motion.quantity("greatest_speed", Dimension::speed, above(0));
  s.greatest_angular_speed =
      motion.quantity("greatest_angular_speed", Dimension::angular_speed, above(0));
  s.motion.acceleration = motion.quantity("acceleration", Dimension::acceleration, above(0));
  s.motion.angular_acceleration =
      motion.quantity("angular_acceleration", Dimension::angular_acceleration, above(0));
  s.motion.rise_time = motion.quantity("rise_time", Dimension::time, above(0));
  s.hold_settling = motion.quantity("hold_settling", Dimension::time, above(0));
  s.retreat_speed = motion.quantity("retreat_speed", Dimension::speed, above(0));
  s.rejoin_speed = motion.quantity("rejoin_speed", Dimension::angular_speed, above(0));
  s.start_time_limit = motion.microseconds("start_time_limit", above(0));
  motion.optional_microseconds("planning_budget", s.planning_budget, above(0));
  motion.finish();

  Config path = config.section("path_check");
  s.path.rates.speed = path.number("joint_speed", above(0));
  s.path.rates.acceleration = path.number("joint_acceleration", above(0));
  s.path.rates.rise_time = path.quantity("joint_rise_time", Dimension::time, above(0));
  s.path.rates.hold_settling = s.hold_settling;
  s.path.manipulability = path.number("manipulability", above(0));
  s.path.sample_time = path.quantity("sample_time", Dimension::time, above(0));
  s.clearance.between = path.quantity("clearance", Dimension::length, above(0));
  s.clearance.within = path.quantity("own_clearance", Dimension::length, above(0));
  path.finish();

  Config guidance = config.section("guidance");
  s.guidance.hold_settling = s.hold_settling;
  s.guidance.stale_after = guidance.microseconds("stale_after", above(0));
  s.guidance.give_up_after = guidance.microseconds("give_up_after", above(0));
  s.guidance.settle_for = guidance.microseconds("settle_for", above(0));
  s.guidance.settle_tolerance = guidance.quantity("settle_tolerance", Dimension::length, above(0));
  s.guidance.good_estimates = guidance.small_integer("good_estimates");
  s.guidance.correction_speed = guidance.quantity("correction_speed", Dimension::speed, above(0));
  s.guidance.correction_angular_speed =
      guidance.quantity("correction_angular_speed", Dimension::angular_speed, above(0));
  s.guidance.largest_correction =
      guidance.quantity("largest_correction", Dimension::length, above(0));
  guidance.optional("largest_correction_share", s.guidance.largest_correction_share);
  s.guidance.largest_angular_correction =
      guidance.quantity("largest_angular_correction", Dimension::angle, above(0));
  guidance.optional("inertial_motion", s.publish_chaser_motion);
  guidance.finish();
  s.profiles = load_profiles(file.parent_path() / "guidance");

  Config safety = config.section("safety");
  s.safety.arm_silence = safety.microseconds("arm_silence", above(0));
  s.safety.heartbeat_silence = safety.microseconds("heartbeat_silence", above(0));
  s.safety.facility_silence = safety.microseconds("facility_silence", above(0));
  s.safety.scan_silence = safety.microseconds("scan_silence", above(0));
  s.safety.watched_nodes = safety.texts("watched_nodes");
  s.safety.watched_in_closed_loop = safety.texts("watched_in_closed_loop");
  s.following_watch.largest_lag = safety.quantity("largest_lag", Dimension::angle, above(0));
  s.following_watch.largest_linear_lag =
      safety.quantity("largest_linear_lag", Dimension::length, above(0));
  s.following_watch.max_dead_time = safety.microseconds("max_dead_time", above(0));
  s.estimate_watch.margin = safety.quantity("largest_estimate_error", Dimension::length, above(0));
  s.estimate_watch.margin_share = safety.number("largest_estimate_error_share", above(0));
  s.min_clearance = safety.quantity("min_clearance", Dimension::length, above(0));
  s.lease_lifetime = safety.microseconds("lease_lifetime", above(0));
  safety.finish();

  Config truth = config.section("ground_truth");
  s.truth.period = period(truth, "rate");
  s.truth.largest_gap = truth.microseconds("largest_gap", above(0));
  s.truth.velocity_window = truth.microseconds("velocity_window", above(0));
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
