// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/bus/loop.h"
#include "common/core/cell.h"
#include "common/core/config.h"

namespace berth {

/// How far geometry and clocks depart from the cell's files: 1 sigma of each kind of error,
/// sections `geometry` and `clocks` of a world (config/worlds). All zero: not at all.
struct PerturbationSizes {
  double base_position = 0;  ///< m, per axis
  double base_rotation = 0;  ///< rad, per axis
  double tool_position = 0;
  double tool_rotation = 0;
  double rotary_zero = 0;       ///< rad
  double linear_zero = 0;       ///< m
  double link_position = 0;     ///< m, per axis and link
  double link_rotation = 0;     ///< rad
  double controller_clock = 0;  ///< s
  double controller_drift = 0;  ///< parts of one
  double report_lag = 0;        ///< s
  double lidar_clock = 0;       ///< s
};

/// Read the sections. @throws InputError.
void read_geometry(Config config, PerturbationSizes& sizes);
void read_clocks(Config config, PerturbationSizes& sizes);

/// Errors of one arm.
struct ArmErrors {
  Pose base;                    ///< T_base_truebase
  Pose tool;                    ///< T_tool_truetool
  Joints zero{};                ///< reported = true + zero
  std::array<Pose, 6> links{};  ///< behind each link, in its frame
  Utime clock = 0;              ///< controller clock minus the cell's
  double drift = 0;             ///< of the controller clock
  Utime report_lag = 0;         ///< in addition to the controller's own; never negative
};

/// The same seed and role draw the same errors.
ArmErrors draw_errors(const PerturbationSizes& sizes, const PlacedArm& arm, std::uint64_t seed);

/// The true cell: bases, tools and link geometry with their errors, and the true target. Its
/// kinematics take true joints.
Cell perturbed_cell(const Cell& nominal, const Target& target, const ArmErrors& replica,
                    const ArmErrors& sensor);

}  // namespace berth
