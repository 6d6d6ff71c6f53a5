// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulation_settings.h"

#include "common/core/positive.h"

namespace berth {
namespace {

void read_time(Config& config, const std::string& key, Utime& value) {
  double s = seconds(value);
  config.optional(key, Dimension::time, s);
  expect_not_negative(config, key, s);
  value = utime_from_seconds(s);
}

SimulatedController::Options read_controller(Config config) {
  SimulatedController::Options options;
  config.optional("connections", options.connections);
  read_time(config, "idle_timeout", options.idle_timeout);
  read_time(config, "interpolation_period", options.robot.interpolation_period);
  read_time(config, "dead_time", options.robot.dead_time);
  read_time(config, "watchdog", options.robot.watchdog);
  config.optional("emergency_braking", options.robot.emergency_braking);
  read_time(config, "report_lag", options.report_lag);
  config.optional("rotary_quantum", Dimension::angle, options.rotary_quantum);
  config.optional("linear_quantum", Dimension::length, options.linear_quantum);
  config.finish();
  if (options.robot.interpolation_period < millisecond) {
    throw config.error("interpolation_period", "must be at least 1 ms");
  }
  expect_positive(config, "emergency_braking", options.robot.emergency_braking);
  return options;
}

SimulatedPlc::Options read_plc(Config config) {
  SimulatedPlc::Options options;
  config.optional("connections", options.connections);
  read_time(config, "idle_timeout", options.idle_timeout);
  read_time(config, "lamp_rise", options.lamp_rise);
  config.optional("lamp_turn", Dimension::angular_speed, options.lamp_turn);
  config.finish();
  if (options.lamp_rise < millisecond) throw config.error("lamp_rise", "must be at least 1 ms");
  expect_positive(config, "lamp_turn", options.lamp_turn);
  return options;
}

SimulatedTracker::Options read_tracker(Config config) {
  SimulatedTracker::Options options;
  options.write = config.boolean("write");
  const double rate = config.quantity("rate", Dimension::frequency);
  if (!(rate > 0 && rate <= 1000)) throw config.error("rate", "expected up to 1 kHz");
  options.period = utime_from_seconds(1 / rate);
  options.place = config.pose("place");
  config.finish();
  return options;
}

SimulatedInertial::Options read_inertial(Config config) {
  SimulatedInertial::Options options;
  options.publish = config.boolean("publish");
  const double rate = config.quantity("rate", Dimension::frequency);
  if (!(rate >= 10 && rate <= 1000)) throw config.error("rate", "expected 10 Hz to 1 kHz");
  options.period = utime_from_seconds(1 / rate);
  options.acceleration_bias = not_negative(config, "acceleration_bias", Dimension::acceleration);
  options.turn_rate_bias = not_negative(config, "turn_rate_bias", Dimension::angular_speed);
  options.velocity_noise = not_negative(config, "velocity_noise", Dimension::speed);
  options.turn_rate_noise = not_negative(config, "turn_rate_noise", Dimension::angular_speed);
  config.finish();
  return options;
}

}  // namespace

SimulationSettings load_simulation(const std::filesystem::path& file) {
  Config config = Config::load(file);
  SimulationSettings settings;
  settings.controller = read_controller(config.section("controller"));
  settings.plc = read_plc(config.section("plc"));
  settings.world = load_world(file.parent_path(), config.text("world"));
  settings.tracker = read_tracker(config.section("tracker"));
  settings.inertial = read_inertial(config.section("inertial_unit"));
  config.finish();
  return settings;
}

}  // namespace berth
