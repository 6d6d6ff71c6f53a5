// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/cell.h"

namespace berth::testbed {

/// Kind of a parameter; each has one prior.
enum class ParameterKind {
  base_position,
  base_rotation,
  mount_position,
  mount_rotation,
  zero,
  length,
  tilt,
  arm_time,
  lidar_time
};
inline constexpr int parameter_kinds = 9;

/// One number by which the cell departs from its files; m, rad or s.
struct CalibrationParameter {
  std::string name;  ///< "replica.zero.1"
  ParameterKind kind = ParameterKind::base_position;
  Dimension dimension = Dimension::length;
};

/// All of them, in the order of every vector and matrix of a calibration. The sensor arm's base
/// defines the cell's frame and has no parameters.
///
///     base.x y z rx ry rz     of the replica arm's base, in its own frame
///     ARM.mount.x ... rz      of the target (replica) or the sensor (sensor) on the flange, in its
///                             own frame
///     ARM.zero.1 ... 6        reported joint minus true joint
///     ARM.a.1 ... 5           length of a link along its x, in standard DH
///     ARM.d.1, 3, 4, 5        and along the axis of the joint that turns it (d.2 is d.3: axes 2
///     and
///                             3 are parallel)
///     ARM.alpha.1 ... 5       twist of a link about its x
///     ARM.beta.2              and about its y, between the parallel axes
///     ARM.time, lidar.time    true time minus stamped time
///
/// These are the complete parameters of both arms, and six too many: see docs/calibration.md.
const std::vector<CalibrationParameter>& calibration_parameters();
inline constexpr int calibration_size = 63;
/// @throws std::out_of_range when there is none of that name.
int parameter_index(const std::string& name);
/// Of the arm's time offset.
int time_index(ArmRole role);
int lidar_time_index();

/// 1 sigma of each kind of parameter.
struct ParameterSigmas {
  double of[parameter_kinds] = {};
  double& operator[](ParameterKind kind) { return of[static_cast<int>(kind)]; }
  double operator[](ParameterKind kind) const { return of[static_cast<int>(kind)]; }
};

/// config/calibration.yaml.
struct CalibrationSettings {
  ParameterSigmas nominal;  ///< prior of truth in a cell without a calibration
  ParameterSigmas search;   ///< prior of a cell to be calibrated
};
/// @throws InputError.
CalibrationSettings load_calibration_settings(const std::filesystem::path& file);

/// Diagonal covariance. A cell without real arms (gantries) has the positions of its mounts and
/// base only.
Eigen::MatrixXd prior_covariance(const Cell& cell, const ParameterSigmas& sigmas);

}  // namespace berth::testbed
