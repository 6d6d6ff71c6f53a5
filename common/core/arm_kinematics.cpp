// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/arm_kinematics.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/body_shapes.h"
#include "common/core/gantry.h"
#include "common/core/spherical_wrist.h"

namespace berth {

double min_singular_value(const Matrix6d& jacobian) {
  const Matrix6d square = jacobian * jacobian.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(square, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(0)));
}

std::string ArmConfiguration::text() const {
  std::string text = std::string(flip ? "F" : "N") + (up ? " U" : " D") + (front ? " T" : " B");
  for (const int turn : turns) text += ", " + std::to_string(turn);
  return text;
}

std::shared_ptr<const ArmKinematics> ArmKinematics::load(const std::filesystem::path& path) {
  Config config = Config::load(path);
  std::shared_ptr<ArmKinematics> arm;
  if (config.choice("kind", {"spherical_wrist", "gantry"}) == "gantry") {
    arm = std::make_shared<Gantry>(config);
  } else {
    arm = std::make_shared<SphericalWristArm>(config);
  }
  arm->name_ = config.text("name");
  for (Config body : config.sections("bodies")) {
    ArmBody part;
    part.name = body.text("name");
    part.link = body.small_integer("link", within(0, 6));  // 0: the base
    part.mesh = read_shape(body);
    body.finish();
    arm->bodies_.push_back(std::move(part));
  }
  config.finish();
  return arm;
}

}  // namespace berth
