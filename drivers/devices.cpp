// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/devices.h"

#include "common/core/config.h"
#include "common/core/quantity.h"

namespace berth {
namespace {

Utime period(Config& config, const std::string& key) {
  return utime_from_seconds(1 / config.quantity(key, Dimension::frequency, within(0.1, 1000)));
}

/// Time-out of a connection attempt: a device that is switched off does not answer.
void read_dial_timeout(Config& config, Utime& timeout) {
  config.optional_microseconds("dial_timeout", timeout, above(0));
}

/// Kind of position that the controller reports: measured by the encoders, or commanded to the
/// servos by its interpolation.
double read_following_lag(Config& config) {
  bool commanded = false;
  config.optional_choice("positions", commanded, {{"measured", false}, {"commanded", true}});
  std::optional<double> lag;
  config.optional("following_lag", Dimension::time, lag, above(0));
  if (commanded && !lag) throw config.error("following_lag", "is missing");
  if (!commanded && lag) {
    throw config.error("following_lag", "is of 'positions: commanded' alone");
  }
  return lag.value_or(0);
}

ArmDevice read_arm(Config config) {
  ArmDevice arm;
  arm.address = config.text("address");
  arm.registers = config.text("registers");
  arm.status_period = period(config, "status_rate");
  arm.setpoint_period = period(config, "setpoint_rate");
  arm.timeout = config.microseconds("timeout");
  read_dial_timeout(config, arm.dial_timeout);
  arm.report_lag = config.microseconds("report_lag");
  arm.rotary_sigma = config.quantity("rotary_sigma", Dimension::angle);
  arm.linear_sigma = config.quantity("linear_sigma", Dimension::length);
  arm.following_lag = read_following_lag(config);
  arm.rotary_guard = config.quantity("rotary_guard", Dimension::angle);
  arm.linear_guard = config.quantity("linear_guard", Dimension::length);
  config.optional("stale_polls", arm.stale_polls);
  config.finish();
  return arm;
}

LidarDevice read_lidar(Config config, const std::filesystem::path& directory) {
  LidarDevice lidar;
  using Kind = LidarDevice::Kind;
  config.optional_choice(
      "adapter", lidar.adapter,
      {{"tcp", Kind::tcp}, {"files", Kind::files}, {"log", Kind::log}, {"folder", Kind::folder}});
  lidar.model = config.text("model");
  std::string address;
  std::string recording;
  config.optional("address", address);
  config.optional("recording", recording);
  const bool tcp = lidar.adapter == Kind::tcp;
  if (tcp && address.empty()) lidar.address = config.text("address");
  lidar.address = address;
  read_dial_timeout(config, lidar.dial_timeout);
  if (!tcp && (recording.empty() || recording == "none")) {
    throw config.error("recording",
                       "found none, expected what adapter " + config.text("adapter") + " reads");
  }
  if (!tcp) lidar.recording = directory / recording;  // an absolute path is kept
  config.optional_choice("time_unit", lidar.us_per_time,
                         {{"found", std::nullopt},
                          {"s", 1e6},
                          {"ms", 1e6 * 1e-3},
                          {"us", 1e6 * 1e-6},
                          {"ns", 1e6 * 1e-9}});
  config.optional("repeat", lidar.repeat);
  config.optional_microseconds("max_gap", lidar.max_gap, at_least(0));
  config.finish();
  return lidar;
}

}  // namespace

Devices load_devices(const std::filesystem::path& config_directory) {
  Config config = Config::load(config_directory / "devices.yaml");
  Devices devices;
  devices.replica_arm = read_arm(config.section("replica_arm"));
  devices.sensor_arm = read_arm(config.section("sensor_arm"));
  Config plc = config.section("plc");
  devices.plc.address = plc.text("address");
  devices.plc.registers = plc.text("registers");
  devices.plc.poll_period = period(plc, "poll_rate");
  devices.plc.timeout = plc.microseconds("timeout");
  read_dial_timeout(plc, devices.plc.dial_timeout);
  plc.finish();
  devices.lidar = read_lidar(config.section("lidar"), config_directory);
  config.finish();
  return devices;
}

}  // namespace berth
