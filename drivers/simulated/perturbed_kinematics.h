// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "common/core/arm_kinematics.h"

namespace berth {

/// An arm whose links are not quite as its file says: behind each link comes a small constant pose.
/// Limits, and what a controller would compute backwards (inverse, Jacobian), are the nominal ones.
class PerturbedKinematics final : public ArmKinematics {
 public:
  PerturbedKinematics(std::shared_ptr<const ArmKinematics> nominal,
                      const std::array<Pose, 6>& links);

  Pose forward(const Joints& joints) const override;
  std::array<Pose, 7> link_poses(const Joints& joints) const override;
  std::vector<InverseSolution> inverse(const Pose& flange, std::string* reason) const override {
    return nominal_->inverse(flange, reason);
  }
  double manipulability(const Joints& joints) const override {
    return nominal_->manipulability(joints);
  }
  Matrix6d jacobian(const Joints& joints) const override { return nominal_->jacobian(joints); }
  Joints motor_joints(const Joints& joints) const override {
    return nominal_->motor_joints(joints);
  }
  std::string limit_violation(const Joints& joints) const override {
    return nominal_->limit_violation(joints);
  }

 private:
  std::shared_ptr<const ArmKinematics> nominal_;
  std::array<Pose, 6> links_;
};

}  // namespace berth
