// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/error.h"
#include "common/core/spherical_wrist.h"
#include "common/core/text.h"

namespace berth::commands {
namespace {

struct KinematicsOptions {
  std::filesystem::path arm;
  std::vector<double> joints;
  std::vector<double> pose;
};

std::array<double, 6> six(const std::vector<double>& values, const std::string& option) {
  std::array<double, 6> six{};
  std::copy(values.begin(), values.end(), six.begin());
  if (!std::all_of(six.begin(), six.end(), [](double v) { return std::isfinite(v); })) {
    throw InputError(option + ": found a value that is not finite, expected six numbers");
  }
  return six;
}

/// As the pendant shows them: degrees, linear axes in mm.
std::string shown(const ArmKinematics& arm, const Joints& joints) {
  std::string text;
  for (std::size_t i = 0; i < 6; ++i) {
    const bool linear = arm.is_linear(static_cast<int>(i));
    char value[32];
    std::snprintf(value, sizeof value, "%10.3f", linear ? 1e3 * joints[i] : degrees(joints[i]));
    text += value;
  }
  return text;
}

/// The joint nearest to a limit of its own, as "J5 32.0 deg".
std::string nearest_limit(const ArmKinematics& arm, const Joints& joints) {
  double min_margin = INFINITY;
  std::string name;
  for (std::size_t i = 0; i < 6; ++i) {
    if (arm.is_linear(static_cast<int>(i))) continue;
    const JointLimit& limit = arm.limits()[i];
    const double margin = std::min(joints[i] - limit.low, limit.high - joints[i]);
    if (margin >= min_margin) continue;
    min_margin = margin;
    name = "J" + std::to_string(i + 1) + " " + fixed(degrees(margin), 1) + " deg";
  }
  return name;
}

void show_forward(const ArmKinematics& arm, const Joints& joints) {
  const Xyzwpr v = xyzwpr_from_pose(arm.forward(joints));
  std::printf("joints         %s\n", shown(arm, joints).c_str());
  std::printf("motors         %s\n", shown(arm, arm.motor_joints(joints)).c_str());
  std::printf("T_base_flange   x %.3f  y %.3f  z %.3f mm   w %.4f  p %.4f  r %.4f deg\n", v[0],
              v[1], v[2], v[3], v[4], v[5]);
  if (const auto* wrist = dynamic_cast<const SphericalWristArm*>(&arm)) {
    std::printf("configuration   %s\n", wrist->configuration(joints).text().c_str());
  }
  std::printf("manipulability  %.3f (0 at a singularity)\n", arm.manipulability(joints));
  const std::string violation = arm.limit_violation(joints);
  std::printf("limits          %s\n", !violation.empty()
                                          ? violation.c_str()
                                          : ("nearest: " + nearest_limit(arm, joints)).c_str());
}

void show_solution(const ArmKinematics& arm, const InverseSolution& solution,
                   const std::string& configuration) {
  std::printf("  %-16s%s  %8.3f  %s\n", configuration.c_str(), shown(arm, solution.joints).c_str(),
              arm.manipulability(solution.joints), nearest_limit(arm, solution.joints).c_str());
}

/// @return how many solutions there are.
std::size_t show_inverse(const ArmKinematics& arm, const Pose& flange) {
  std::printf("  %-16s%10s%10s%10s%10s%10s%10s  manipul.  nearest limit\n", "configuration", "J1",
              "J2", "J3", "J4", "J5", "J6");
  std::size_t count = 0;
  if (const auto* wrist = dynamic_cast<const SphericalWristArm*>(&arm)) {
    for (const SphericalWristArm::Branch& branch : wrist->branches(flange)) {
      for (const InverseSolution& solution : branch.solutions) {
        show_solution(arm, solution, solution.configuration.text());
      }
      count += branch.solutions.size();
      if (branch.solutions.empty()) {
        std::printf("  %-16s%s\n", branch.configuration.text().substr(0, 5).c_str(),
                    branch.obstacle.c_str());
      }
    }
    return count;
  }
  std::string reason;
  for (const InverseSolution& solution : arm.inverse(flange, &reason)) {
    show_solution(arm, solution, "");
    ++count;
  }
  if (count == 0) std::printf("  %s\n", reason.c_str());
  return count;
}

int kinematics(const KinematicsOptions& options) {
  if (options.joints.empty() == options.pose.empty()) {
    throw InputError("expected either --joints or --pose");
  }
  const auto arm = ArmKinematics::load(options.arm);
  std::printf("%s (%s)\n", arm->name().c_str(), options.arm.c_str());
  if (!options.joints.empty()) {
    Joints joints = six(options.joints, "--joints");
    for (std::size_t i = 0; i < 6; ++i) {
      joints[i] = arm->is_linear(static_cast<int>(i)) ? 1e-3 * joints[i] : radians(joints[i]);
    }
    show_forward(*arm, joints);
    return arm->limit_violation(joints).empty() ? exit_code::passed : exit_code::failed;
  }
  const std::size_t count = show_inverse(*arm, pose_from_xyzwpr(six(options.pose, "--pose")));
  std::printf("%zu solutions within the limits\n", count);
  return count > 0 ? exit_code::passed : exit_code::failed;
}

}  // namespace

void add_kinematics(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "kinematics", "An arm's flange for joints, or every way to reach a flange pose");
  auto options = std::make_shared<KinematicsOptions>();
  command->add_option("arm", options->arm, "Arm file, as config/arms/m710ic_50.yaml")
      ->required()
      ->check(CLI::ExistingFile);
  command->add_option("--joints", options->joints, "Joints as on the pendant: deg (axes: mm)")
      ->delimiter(',')
      ->expected(6)
      ->option_text("J1,...,J6");
  command->add_option("--pose", options->pose, "T_base_flange: mm and deg")
      ->delimiter(',')
      ->expected(6)
      ->option_text("X,Y,Z,W,P,R");
  command->footer(
      "For a pose all eight branches are listed, with each set of turns that is within the "
      "limits,\n"
      "or why a branch is closed: unreachable, singular, or which joint's limit.\n"
      "Exit codes: 0 within the limits, 1 not, 2 the input was at fault.");
  command->callback([options, &exit_code] { exit_code = kinematics(*options); });
}

}  // namespace berth::commands
