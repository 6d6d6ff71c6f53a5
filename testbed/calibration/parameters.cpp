// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/parameters.h"

#include <algorithm>
#include <stdexcept>

#include "common/core/config.h"

namespace berth::testbed {
namespace {

using Kind = ParameterKind;

void add_pose(std::vector<CalibrationParameter>& list, const std::string& name, Kind position,
              Kind rotation) {
  for (const char* axis : {"x", "y", "z"}) {
    list.push_back({name + "." + axis, position, Dimension::length});
  }
  for (const char* axis : {"rx", "ry", "rz"}) {
    list.push_back({name + "." + axis, rotation, Dimension::angle});
  }
}

void add_numbered(std::vector<CalibrationParameter>& list, const std::string& name,
                  std::initializer_list<int> numbers, Kind kind, Dimension dimension) {
  for (const int i : numbers) list.push_back({name + "." + std::to_string(i), kind, dimension});
}

std::vector<CalibrationParameter> make_parameters() {
  std::vector<CalibrationParameter> list;
  add_pose(list, "base", Kind::base_position, Kind::base_rotation);
  for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
    const std::string arm = name_of(role);
    add_pose(list, arm + ".mount", Kind::mount_position, Kind::mount_rotation);
    add_numbered(list, arm + ".zero", {1, 2, 3, 4, 5, 6}, Kind::zero, Dimension::angle);
    add_numbered(list, arm + ".a", {1, 2, 3, 4, 5}, Kind::length, Dimension::length);
    add_numbered(list, arm + ".d", {1, 3, 4, 5}, Kind::length, Dimension::length);
    add_numbered(list, arm + ".alpha", {1, 2, 3, 4, 5}, Kind::tilt, Dimension::angle);
    add_numbered(list, arm + ".beta", {2}, Kind::tilt, Dimension::angle);
  }
  for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
    list.push_back({std::string(name_of(role)) + ".time", Kind::arm_time, Dimension::time});
  }
  list.push_back({"lidar.time", Kind::lidar_time, Dimension::time});
  return list;
}

ParameterSigmas read_sigmas(Config config) {
  ParameterSigmas sigmas;
  const auto read = [&](const char* key, Kind kind, Dimension dimension) {
    sigmas[kind] = config.quantity(key, dimension, above(0));
  };
  read("base_position", Kind::base_position, Dimension::length);
  read("base_rotation", Kind::base_rotation, Dimension::angle);
  read("mount_position", Kind::mount_position, Dimension::length);
  read("mount_rotation", Kind::mount_rotation, Dimension::angle);
  read("zero", Kind::zero, Dimension::angle);
  read("length", Kind::length, Dimension::length);
  read("tilt", Kind::tilt, Dimension::angle);
  read("arm_time", Kind::arm_time, Dimension::time);
  read("lidar_time", Kind::lidar_time, Dimension::time);
  config.finish();
  return sigmas;
}

bool has_linear_axis(const ArmKinematics& arm) {
  for (int i = 0; i < 6; ++i) {
    if (arm.is_linear(i)) return true;
  }
  return false;
}

}  // namespace

const std::vector<CalibrationParameter>& calibration_parameters() {
  static const std::vector<CalibrationParameter> all = make_parameters();
  return all;
}

int parameter_index(const std::string& name) {
  const auto& all = calibration_parameters();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.name == name; });
  if (found == all.end()) throw std::out_of_range("no calibration parameter '" + name + "'");
  return static_cast<int>(found - all.begin());
}

int time_index(ArmRole role) { return calibration_size - (role == ArmRole::replica ? 3 : 2); }

int lidar_time_index() { return calibration_size - 1; }

CalibrationSettings load_calibration_settings(const std::filesystem::path& file) {
  Config config = Config::load(file);
  CalibrationSettings settings;
  settings.nominal = read_sigmas(config.section("nominal"));
  settings.search = read_sigmas(config.section("search"));
  config.finish();
  return settings;
}

Eigen::MatrixXd prior_covariance(const Cell& cell, const ParameterSigmas& sigmas) {
  const bool real_arms =
      !has_linear_axis(*cell.replica.kinematics) && !has_linear_axis(*cell.sensor.kinematics);
  Eigen::VectorXd variance(calibration_size);
  for (int i = 0; i < calibration_size; ++i) {
    const Kind kind = calibration_parameters()[static_cast<std::size_t>(i)].kind;
    const bool of_arms = kind == Kind::zero || kind == Kind::length || kind == Kind::tilt ||
                         kind == Kind::base_rotation;
    variance[i] = of_arms && !real_arms ? 0 : sigmas[kind] * sigmas[kind];
  }
  return variance.asDiagonal();
}

}  // namespace berth::testbed
