// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/arm_kinematics.h"

namespace berth {

/// Six axes x y z w p r that place the flange directly: T_base_flange = the pose that a pendant
/// would show for them (R = Rz(r) Ry(p) Rx(w)), in m and rad. For the free scene: relative motion
/// without arms. Its inverse gives the two attitude branches with w, p and r each nearest zero;
/// whole turns more are as good as long as they are within the limits.
class Gantry final : public ArmKinematics {
 public:
  /// Reads "travel", "turn" (both -limit..limit) and their speeds and accelerations. @throws
  /// InputError.
  explicit Gantry(Config& config);

  Pose forward(const Joints& joints) const override;
  std::array<Pose, 7> link_poses(const Joints& joints) const override;
  std::vector<InverseSolution> inverse(const Pose& flange, std::string* reason) const override;
  double manipulability(const Joints& joints) const override;
  Matrix6d jacobian(const Joints& joints) const override;
  std::string limit_violation(const Joints& joints) const override;
};

}  // namespace berth
