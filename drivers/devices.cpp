// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/devices.h"

#include "common/core/config.h"
#include "common/core/positive.h"
#include "common/core/quantity.h"

namespace berth {
namespace {

Utime period(Config& config, const std::string& key) {
  const double rate = config.quantity(key, Dimension::frequency);
  if (!(rate >= 0.1 && rate <= 1000)) {
    throw config.error(key, "found a rate outside 0.1 Hz to 1 kHz");
  }
  return utime_from_seconds(1 / rate);
}

Utime time(Config& config, const std::string& key) {
  return utime_from_seconds(config.quantity(key, Dimension::time));
}

/// Of a connection; a device that is switched off answers nothing.
void read_dial_timeout(Config& config, Utime& timeout) {
  double value = seconds(timeout);
  config.optional("dial_timeout", Dimension::time, value);
  expect_positive(config, "dial_timeout", value);
  timeout = utime_from_seconds(value);
}

/// What the controller's position is: measured by the encoders, or what its interpolation has
/// handed to the servos.
double read_following_lag(Config& config) {
  const bool commanded = config.has("positions") &&
                         config.choice("positions", {"measured", "commanded"}) == "commanded";
  if (!commanded) {
    if (config.has("following_lag")) {
      throw config.error("following_lag", "is of 'positions: commanded' alone");
    }
    return 0;
  }
  return positive(config, "following_lag", Dimension::time);
}

ArmDevice read_arm(Config config) {
  ArmDevice arm;
  arm.address = config.text("address");
  arm.registers = config.text("registers");
  arm.status_period = period(config, "status_rate");
  arm.setpoint_period = period(config, "setpoint_rate");
  arm.timeout = time(config, "timeout");
  read_dial_timeout(config, arm.dial_timeout);
  arm.report_lag = time(config, "report_lag");
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
  const std::string adapter =
      config.has("adapter") ? config.choice("adapter", {"tcp", "files", "log", "folder"}) : "tcp";
  lidar.adapter = adapter == "files"    ? LidarDevice::Kind::files
                  : adapter == "log"    ? LidarDevice::Kind::log
                  : adapter == "folder" ? LidarDevice::Kind::folder
                                        : LidarDevice::Kind::tcp;
  lidar.model = config.text("model");
  std::string address;
  std::string recording;
  config.optional("address", address);
  config.optional("recording", recording);
  const bool tcp = lidar.adapter == LidarDevice::Kind::tcp;
  if (tcp && address.empty()) lidar.address = config.text("address");
  lidar.address = address;
  read_dial_timeout(config, lidar.dial_timeout);
  if (!tcp && (recording.empty() || recording == "none")) {
    throw config.error("recording", "found none, expected what adapter " + adapter + " reads");
  }
  if (!tcp) lidar.recording = directory / recording;  // an absolute one stays as it is
  if (config.has("time_unit")) {
    const std::string unit = config.choice("time_unit", {"found", "s", "ms", "us", "ns"});
    if (unit != "found") lidar.us_per_time = 1e6 * find_unit(unit, Dimension::time).value();
  }
  config.optional("repeat", lidar.repeat);
  double gap = seconds(lidar.max_gap);
  config.optional("max_gap", Dimension::time, gap);
  expect_not_negative(config, "max_gap", gap);
  lidar.max_gap = utime_from_seconds(gap);
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
  devices.plc.timeout = time(plc, "timeout");
  read_dial_timeout(plc, devices.plc.dial_timeout);
  plc.finish();
  devices.lidar = read_lidar(config.section("lidar"), config_directory);
  config.finish();
  return devices;
}

}  // namespace berth
