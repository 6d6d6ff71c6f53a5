// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulation_settings.h"

#include "common/core/config.h"

namespace berth {
namespace {

SimulatedController::Options read_controller(Config config) {
  SimulatedController::Options options;
  config.optional("connections", options.connections);
  config.optional_microseconds("idle_timeout", options.idle_timeout, at_least(0));
  config.optional_microseconds("interpolation_period", options.robot.interpolation_period,
                               at_least(1e-3));
  config.optional_microseconds("dead_time", options.robot.dead_time, at_least(0));
  config.optional_microseconds("watchdog", options.robot.watchdog, at_least(0));
  config.optional("emergency_braking", options.robot.emergency_braking, above(0));
  config.optional_microseconds("report_lag", options.report_lag, at_least(0));
  config.optional("rotary_quantum", Dimension::angle, options.rotary_quantum);
  config.optional("linear_quantum", Dimension::length, options.linear_quantum);
  config.finish();
  return options;
}

SimulatedPlc::Options read_plc(Config config) {
  SimulatedPlc::Options options;
  config.optional("connections", options.connections);
  config.optional_microseconds("idle_timeout", options.idle_timeout, at_least(0));
  config.optional_microseconds("lamp_rise", options.lamp_rise, at_least(1e-3));
  config.optional("lamp_turn", Dimension::angular_speed, options.lamp_turn, above(0));
  config.finish();
  return options;
}

SimulatedTracker::Options read_tracker(Config config) {
  SimulatedTracker::Options options;
  options.write = config.boolean("write");
  const double rate = config.quantity("rate", Dimension::frequency, above(0).at_most(1000));
  options.period = utime_from_seconds(1 / rate);
  options.place = config.pose("place");
  config.finish();
  return options;
}

SimulatedInertial::Options read_inertial(Config config) {
  SimulatedInertial::Options options;
  options.publish = config.boolean("publish");
  const double rate = config.quantity("rate", Dimension::frequency, within(10, 1000));
  options.period = utime_from_seconds(1 / rate);
  options.acceleration_bias =
      config.quantity("acceleration_bias", Dimension::acceleration, at_least(0));
  options.turn_rate_bias = config.quantity("turn_rate_bias", Dimension::angular_speed, at_least(0));
  options.velocity_noise = config.quantity("velocity_noise", Dimension::speed, at_least(0));
  options.turn_rate_noise =
      config.quantity("turn_rate_noise", Dimension::angular_speed, at_least(0));
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
