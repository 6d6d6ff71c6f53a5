// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/corrected_kinematics.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace berth {
namespace {

/// Whether two solutions differ by whole turns alone.
bool same_branch(const Joints& a, const Joints& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::abs(std::remainder(a[i] - b[i], 2 * std::numbers::pi)) > 1e-9) return false;
  }
  return true;
}

}  // namespace

CorrectedKinematics::CorrectedKinematics(std::shared_ptr<const ArmKinematics> nominal,
                                         const KinematicCorrections& corrections)
    : nominal_(std::move(nominal)), corrections_(corrections) {
  name_ = nominal_->name();
  limits_ = nominal_->limits();
  bodies_ = nominal_->bodies();
  const Joints at_zero = nominal_->motor_joints({});
  for (std::size_t j = 0; j < 6; ++j) {
    linear_[j] = nominal_->is_linear(static_cast<int>(j));
    rotary_ = rotary_ && !linear_[j];
    Joints unit{};
    unit[j] = 1;
    const Joints motors = nominal_->motor_joints(unit);
    for (std::size_t k = 0; k < 6; ++k) {
      motors_by_joints_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j)) =
          motors[k] - at_zero[k];
    }
  }
}

Joints CorrectedKinematics::without_zero(const Joints& reported) const {
  Joints joints = reported;
  for (std::size_t i = 0; i < 6; ++i) joints[i] -= corrections_.zero[i];
  return joints;
}

std::array<Pose, 7> CorrectedKinematics::link_poses(const Joints& joints) const {
  const std::array<Pose, 7> nominal = nominal_->link_poses(without_zero(joints));
  std::array<Pose, 7> links;
  links[0] = nominal[0];
  for (std::size_t i = 1; i < links.size(); ++i) {
    links[i] = links[i - 1] * (nominal[i - 1].inverse() * nominal[i]) * corrections_.links[i - 1];
    links[i].rotation.normalize();
  }
  return links;
}

Pose CorrectedKinematics::forward(const Joints& joints) const { return link_poses(joints)[6]; }

Matrix6d CorrectedKinematics::jacobian(const Joints& joints) const {
  if (!rotary_) return nominal_->jacobian(without_zero(joints));
  const std::array<Pose, 7> links = link_poses(joints);
  Matrix6d by_motors;
  for (std::size_t k = 0; k < 6; ++k) {
    const Vector3d axis = links[k].rotation * Vector3d::UnitZ();
    const auto column = static_cast<Eigen::Index>(k);
    by_motors.block<3, 1>(0, column) = axis.cross(links[6].position - links[k].position);
    by_motors.block<3, 1>(3, column) = axis;
  }
  return by_motors * motors_by_joints_;
}

double CorrectedKinematics::manipulability(const Joints& joints) const {
  return nominal_->manipulability(without_zero(joints));
}

bool CorrectedKinematics::refine(const Pose& flange, Joints& joints) const {
  constexpr int max_steps = 12;
  constexpr double good_enough = 1e-12;  // m and rad
  for (int step = 0; step < max_steps; ++step) {
    const Vector6d error = difference(forward(joints), flange);
    if (error.norm() < good_enough) return true;
    const Vector6d change = jacobian(joints).partialPivLu().solve(error);
    if (!(change.norm() < 1)) return false;
    for (std::size_t i = 0; i < 6; ++i) joints[i] += change[static_cast<Eigen::Index>(i)];
  }
  return difference(forward(joints), flange).norm() < 1e-9;
}

std::vector<InverseSolution> CorrectedKinematics::inverse(const Pose& flange,
                                                          std::string* reason) const {
  std::string why;
  std::vector<InverseSolution> solutions;
  const std::vector<InverseSolution> starts = nominal_->inverse(flange, &why);
  const InverseSolution* refined_start = nullptr;  // of the branch refined last
  Joints change{};
  bool converged = false;
  for (const InverseSolution& start : starts) {
    InverseSolution solution = start;
    if (refined_start == nullptr || !same_branch(start.joints, refined_start->joints)) {
      refined_start = &start;
      for (std::size_t i = 0; i < 6; ++i) solution.joints[i] += corrections_.zero[i];
      converged = refine(flange, solution.joints);
      for (std::size_t i = 0; i < 6; ++i) change[i] = solution.joints[i] - start.joints[i];
    } else {
      for (std::size_t i = 0; i < 6; ++i) solution.joints[i] += change[i];
    }
    if (!converged) {
      if (why.empty()) why = "singular: the corrected arm does not reach the pose";
      continue;
    }
    const std::string violation = limit_violation(solution.joints);
    if (!violation.empty()) {
      if (why.empty()) why = "out of limits: " + violation;
      continue;
    }
    solutions.push_back(solution);
  }
  if (reason != nullptr) *reason = solutions.empty() ? why : "";
  return solutions;
}

}  // namespace berth
