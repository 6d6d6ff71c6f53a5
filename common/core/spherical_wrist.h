// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/arm_kinematics.h"

namespace berth {

/// A six-axis arm whose wrist axes meet in a point, with the Fanuc parallelogram: the pendant's J3
/// is the forearm's angle to the horizontal, so that the relative joint 3 (what its motor turns) is
/// J2 + J3. Standard DH, lengths in m, angles as on the pendant:
///
///     i   a    alpha   d    theta
///     1   a1   -90     0    J1
///     2   a2   180     0    J2 - 90
///     3   a3   -90     0    J2 + J3
///     4   0     90    -d4   J4
///     5   0    -90     0    J5
///     6   0    180    -d6   J6
///
/// Base: the controller's World, on the axis of J1 at the height of J2. link_poses() are the DH
/// frames. Configuration: N is J5 <= 0, U the elbow above the line from shoulder to wrist as at all
/// joints zero, T the wrist in front of the axis of J1 as joint 1 sees it; turn 0 is -180..180
/// degrees.
class SphericalWristArm final : public ArmKinematics {
 public:
  struct Geometry {
    double a1 = 0;  ///< J1 to J2, horizontal
    double a2 = 0;  ///< J2 to J3
    double a3 = 0;  ///< J3 to the axis of J4
    double d4 = 0;  ///< along the axis of J4 to the wrist centre
    double d6 = 0;  ///< wrist centre to faceplate
  };

  /// Reads "geometry", "coupling" and "joints" of an arm file. @throws InputError.
  explicit SphericalWristArm(Config& config);

  Pose forward(const Joints& joints) const override;
  std::array<Pose, 7> link_poses(const Joints& joints) const override;
  std::vector<InverseSolution> inverse(const Pose& flange, std::string* reason) const override;
  double manipulability(const Joints& joints) const override;
  Matrix6d jacobian(const Joints& joints) const override;
  Joints motor_joints(const Joints& joints) const override;
  std::string limit_violation(const Joints& joints) const override;

  ArmConfiguration configuration(const Joints& joints) const;

  /// One of the eight ways to hold the flange: F/N, U/D, T/B.
  struct Branch {
    ArmConfiguration configuration;          ///< turns 0
    std::vector<InverseSolution> solutions;  ///< one for each set of turns within the limits
    /// Why there is none: "singular: ...", "out of limits: ..." or "unreachable: ...".
    std::string obstacle;
  };
  /// All eight, for a person: what inverse() returns and what it leaves out.
  std::vector<Branch> branches(const Pose& flange) const;

 private:
  /// One way to place the wrist centre; J4 to J6 still 0.
  struct Placement {
    Joints joints{};
    bool front = true;
    bool up = true;
  };
  template <class Found, class Closed>
  void place_wrist(const Vector3d& wrist, const Found& found, const Closed& closed) const;
  template <class Found, class Closed>
  void solve(const Pose& flange, const Found& found, const Closed& closed) const;
  bool within_limits(const Joints& joints) const;

  Geometry geometry_;
  double forearm_ = 0;        // elbow to wrist centre
  double forearm_angle_ = 0;  // of that line above the axis of J4
  double sum_low_ = 0;        // of J2 + J3
  double sum_high_ = 0;
};

}  // namespace berth
