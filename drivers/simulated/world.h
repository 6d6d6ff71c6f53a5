// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "drivers/simulated/perturbation.h"
#include "drivers/simulated/receiver/receiver.h"
#include "drivers/simulated/simulated_robot.h"
#include "drivers/simulated/true_target.h"

namespace berth {

/// Deviations of the simulated world from the cell's files: a file of config/worlds. Keys left out
/// mean no error.
struct WorldSettings {
  PerturbationSizes cell;
  TargetDepartures target;
  ScannerErrors scanner;  ///< range_bias: 1 sigma of the run's
  SimulatedRobot::Program program = SimulatedRobot::Program::interpolating;  ///< of both arms
  int cnt = 100;  ///< of position_register
};

/// The world of that name in a configuration directory. @throws InputError that lists the names
/// there are.
WorldSettings load_world(const std::filesystem::path& config, const std::string& name);

/// Errors of the LIDAR.
struct LidarErrors {
  Utime clock = 0;        ///< device clock minus the cell's
  ScannerErrors scanner;  ///< range_bias: of this run
};

/// The same seed draws the same errors.
LidarErrors draw_lidar_errors(const WorldSettings& world, std::uint64_t seed);

/// The random draws, as YAML for tests and reports: world.yaml in the run directory.
std::string text_of(const ArmErrors& replica, const ArmErrors& sensor, const TrueTarget& target,
                    const LidarErrors& lidar);

}  // namespace berth
