// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/perturbation.h"

#include <algorithm>
#include <cmath>

#include "common/core/corrected_kinematics.h"
#include "common/core/random.h"

namespace berth {
namespace {

Pose draw_pose(Random& random, double position, double rotation) {
  const Vector3d shift = random.normal_vector(position);
  return {shift, rotation_from_vector(random.normal_vector(rotation))};
}

}  // namespace

void read_geometry(Config config, PerturbationSizes& sizes) {
  config.optional("base_position", Dimension::length, sizes.base_position, at_least(0));
  config.optional("base_rotation", Dimension::angle, sizes.base_rotation, at_least(0));
  config.optional("tool_position", Dimension::length, sizes.tool_position, at_least(0));
  config.optional("tool_rotation", Dimension::angle, sizes.tool_rotation, at_least(0));
  config.optional("rotary_zero", Dimension::angle, sizes.rotary_zero, at_least(0));
  config.optional("linear_zero", Dimension::length, sizes.linear_zero, at_least(0));
  config.optional("link_position", Dimension::length, sizes.link_position, at_least(0));
  config.optional("link_rotation", Dimension::angle, sizes.link_rotation, at_least(0));
  config.finish();
}

void read_clocks(Config config, PerturbationSizes& sizes) {
  config.optional("controller", Dimension::time, sizes.controller_clock, at_least(0));
  config.optional("controller_drift", Dimension::number, sizes.controller_drift, at_least(0));
  config.optional("report_lag", Dimension::time, sizes.report_lag, at_least(0));
  config.optional("lidar", Dimension::time, sizes.lidar_clock, at_least(0));
  config.finish();
}

ArmErrors draw_errors(const PerturbationSizes& sizes, const PlacedArm& arm, std::uint64_t seed) {
  Random random(seed, std::string("perturbation of the ") + name_of(arm.role) + " arm");
  ArmErrors errors;
  errors.base = draw_pose(random, sizes.base_position, sizes.base_rotation);
  errors.tool = draw_pose(random, sizes.tool_position, sizes.tool_rotation);
  for (std::size_t i = 0; i < 6; ++i) {
    const bool linear = arm.kinematics->is_linear(static_cast<int>(i));
    errors.zero[i] = random.normal(linear ? sizes.linear_zero : sizes.rotary_zero);
  }
  for (Pose& link : errors.links) {
    link = draw_pose(random, sizes.link_position, sizes.link_rotation);
  }
  errors.clock = utime_from_seconds(random.normal(sizes.controller_clock));
  errors.drift = random.normal(sizes.controller_drift);
  errors.report_lag = utime_from_seconds(std::abs(random.normal(sizes.report_lag)));
  return errors;
}

Cell perturbed_cell(const Cell& nominal, const Target& target, const ArmErrors& replica,
                    const ArmErrors& sensor) {
  Cell world = nominal;
  world.target = target;
  const auto perturb = [](PlacedArm& arm, const ArmErrors& errors) {
    arm.base = arm.base * errors.base;
    arm.tool = arm.tool * errors.tool;
    const auto is_none = [](const Pose& link) {
      return link.position.isZero(0) && link.rotation.vec().isZero(0);
    };
    if (!std::all_of(errors.links.begin(), errors.links.end(), is_none)) {
      arm.kinematics = std::make_shared<CorrectedKinematics>(
          arm.kinematics, KinematicCorrections{{}, errors.links});
    }
  };
  perturb(world.replica, replica);
  perturb(world.sensor, sensor);
  return world;
}

}  // namespace berth
