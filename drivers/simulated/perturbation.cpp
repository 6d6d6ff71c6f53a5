// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/perturbation.h"

#include <algorithm>
#include <cmath>

#include "common/core/corrected_kinematics.h"
#include "common/core/random.h"
#include "common/core/text.h"

namespace berth {
namespace {

Pose draw_pose(Random& random, double position, double rotation) {
  const Vector3d shift = random.normal_vector(position);
  return {shift, rotation_from_vector(random.normal_vector(rotation))};
}

/// [x, y, z, w, p, r] in mm and degrees.
std::string listed(const Pose& pose) {
  std::string text;
  for (const double value : xyzwpr_from_pose(pose)) {
    text += (text.empty() ? "[" : ", ") + fixed(value, 5);
  }
  return text + "]";
}

}  // namespace

PerturbationSizes load_perturbation(const std::filesystem::path& file) {
  Config config = Config::load(file);
  PerturbationSizes sizes;
  config.optional("base_position", Dimension::length, sizes.base_position);
  config.optional("base_rotation", Dimension::angle, sizes.base_rotation);
  config.optional("tool_position", Dimension::length, sizes.tool_position);
  config.optional("tool_rotation", Dimension::angle, sizes.tool_rotation);
  config.optional("rotary_zero", Dimension::angle, sizes.rotary_zero);
  config.optional("linear_zero", Dimension::length, sizes.linear_zero);
  config.optional("link_position", Dimension::length, sizes.link_position);
  config.optional("link_rotation", Dimension::angle, sizes.link_rotation);
  config.optional("controller_clock", Dimension::time, sizes.controller_clock);
  config.optional("controller_drift", sizes.controller_drift);
  config.optional("report_lag", Dimension::time, sizes.report_lag);
  config.optional("lidar_clock", Dimension::time, sizes.lidar_clock);
  config.optional("lidar_range", Dimension::length, sizes.lidar_range);
  config.finish();
  return sizes;
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

LidarErrors draw_lidar_errors(const PerturbationSizes& sizes, std::uint64_t seed) {
  Random random(seed, "perturbation of the lidar");
  LidarErrors errors;
  errors.clock = utime_from_seconds(random.normal(sizes.lidar_clock));
  errors.range = random.normal(sizes.lidar_range);
  return errors;
}

std::string text_of(const ArmErrors& replica, const ArmErrors& sensor, const LidarErrors& lidar) {
  std::string text =
      "# SPDX-License-Identifier: BSD-3-Clause\n# By how much the simulated world departed from "
      "the "
      "cell's files.\n";
  for (const auto& [name, errors] : {std::pair{"replica", &replica}, {"sensor", &sensor}}) {
    text += std::string(name) + ":\n  base: " + listed(errors->base) +
            "\n  tool: " + listed(errors->tool) + "\n  zero: [";
    for (std::size_t i = 0; i < 6; ++i) {
      text += (i == 0 ? "" : ", ") + fixed(degrees(errors->zero[i]), 5) + " deg";
    }
    text += "]\n  links:\n";
    for (const Pose& link : errors->links) text += "    - " + listed(link) + "\n";
    text += "  clock: " + fixed(1e3 * seconds(errors->clock), 3) +
            " ms\n  report_lag: " + fixed(1e3 * seconds(errors->report_lag), 3) + " ms\n";
  }
  return text + "lidar:\n  clock: " + fixed(1e3 * seconds(lidar.clock), 3) +
         " ms\n  range: " + fixed(1e3 * lidar.range, 3) + " mm\n";
}

Cell perturbed_cell(const Cell& nominal, const ArmErrors& replica, const ArmErrors& sensor) {
  Cell world = nominal;
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
