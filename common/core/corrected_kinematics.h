// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "common/core/arm_kinematics.h"

namespace berth {

/// How an arm departs from its file.
struct KinematicCorrections {
  Joints zero{};                ///< reported joints minus those that the geometry takes
  std::array<Pose, 6> links{};  ///< behind each link, in its frame
};

/// Kinematics of an arm whose zeros and links are corrected by calibration. Takes reported joints;
/// limits and bodies are the nominal ones.
class CorrectedKinematics final : public ArmKinematics {
 public:
  CorrectedKinematics(std::shared_ptr<const ArmKinematics> nominal,
                      const KinematicCorrections& corrections);

  Pose forward(const Joints& joints) const override;
  std::array<Pose, 7> link_poses(const Joints& joints) const override;
  /// The nominal branches, each led to the pose by Newton's method; one that does not get there
  /// within its limits is left out.
  std::vector<InverseSolution> inverse(const Pose& flange, std::string* reason) const override;
  double manipulability(const Joints& joints) const override;
  /// Exact for rotary arms; that of the nominal arm for others.
  Matrix6d jacobian(const Joints& joints) const override;
  Joints motor_joints(const Joints& joints) const override {
    return nominal_->motor_joints(joints);
  }
  std::string limit_violation(const Joints& joints) const override {
    return nominal_->limit_violation(joints);
  }

 private:
  Joints without_zero(const Joints& reported) const;
  bool refine(const Pose& flange, Joints& joints) const;

  std::shared_ptr<const ArmKinematics> nominal_;
  KinematicCorrections corrections_;
  Matrix6d motors_by_joints_;  // d motor joint / d joint
  bool rotary_ = true;
};

}  // namespace berth
