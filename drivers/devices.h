// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/bus/sockets.h"
#include "common/core/cell.h"

namespace berth {

/// One arm controller, as config/devices.yaml has it.
struct ArmDevice {
  std::string address;    ///< host:port
  std::string registers;  ///< config/registers/<registers>.yaml
  Utime status_period = 10 * millisecond;
  Utime setpoint_period = 16667;
  Utime timeout = 50 * millisecond;            ///< of an answer
  Utime dial_timeout = Sockets::dial_timeout;  ///< of a connection
  Utime report_lag = 0;
  double rotary_sigma = 0;  ///< rad
  double linear_sigma = 0;  ///< m
  /// s by which the servos lag the joints that the controller reports, 1 sigma; 0: it reports the
  /// encoders.
  double following_lag = 0;
  double rotary_guard = 0;  ///< rad
  double linear_guard = 0;  ///< m
  int stale_polls = 10;
};

struct PlcDevice {
  std::string address;
  std::string registers;
  Utime poll_period = 50 * millisecond;
  Utime timeout = 100 * millisecond;
  Utime dial_timeout = Sockets::dial_timeout;
};

/// The LIDAR driver's source of scans (docs/lidar.md).
struct LidarDevice {
  enum class Kind { tcp, files, log, folder };
  Kind adapter = Kind::tcp;
  std::string address;                         ///< of tcp: host:port
  Utime dial_timeout = Sockets::dial_timeout;  ///< of tcp
  std::string model;                           ///< config/lidars/<model>.yaml
  std::filesystem::path recording;             ///< of files, log and folder
  std::optional<double> us_per_time;  ///< unit of the times in files; none: from name or values
  bool repeat = false;                ///< a recording that is over starts anew
  Utime max_gap = 10 * second;        ///< between two scans of a recording: longer ones are cut
};

/// All hardware devices of one cell.
struct Devices {
  ArmDevice replica_arm;
  ArmDevice sensor_arm;
  PlcDevice plc;
  LidarDevice lidar;

  const ArmDevice& arm(ArmRole role) const {
    return role == ArmRole::replica ? replica_arm : sensor_arm;
  }
};

/// Reads devices.yaml of a configuration directory. @throws InputError.
Devices load_devices(const std::filesystem::path& config_directory);

}  // namespace berth
