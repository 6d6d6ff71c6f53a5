// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "common/core/mesh.h"
#include "common/core/pose.h"

namespace berth {

/// Of a Jacobian, to about 1e-8 of its greatest one (from the eigenvalues of J J^T: far quicker
/// than a decomposition).
double min_singular_value(const Matrix6d& jacobian);

/// Six joints as the teach pendant counts them: rad for rotary axes, m for linear ones.
using Joints = std::array<double, 6>;

struct JointLimit {
  double low = 0;
  double high = 0;
  double speed = 0;         ///< per second
  double acceleration = 0;  ///< per second squared
};

/// Which of the configurations of a Fanuc arm, as in "N U T, 0, 0, 0".
struct ArmConfiguration {
  bool flip = false;           ///< F / N
  bool up = true;              ///< U / D
  bool front = true;           ///< T (toward the front) / B
  std::array<int, 3> turns{};  ///< of J4, J5, J6
  std::string text() const;
};

struct InverseSolution {
  Joints joints{};
  ArmConfiguration configuration;
};

/// A part of an arm for ray casting and clearance: moves with the link.
struct ArmBody {
  std::string name;
  int link = 0;  ///< 0: base, i: moves with joint i
  Mesh mesh;     ///< in the frame that link_poses() gives
};

/// Geometry, limits and bodies of one arm, from a file of config/arms. Two kinds: `spherical_wrist`
/// (standard DH with the Fanuc J2/J3 coupling) and `gantry` (x y z w p r, for the free scene).
class ArmKinematics {
 public:
  static std::shared_ptr<const ArmKinematics> load(const std::filesystem::path& path);
  virtual ~ArmKinematics() = default;

  /// T_base_flange. Base: the controller's World frame; flange: the faceplate, z out of it.
  virtual Pose forward(const Joints& joints) const = 0;
  /// T_base_link for links 0..6.
  virtual std::array<Pose, 7> link_poses(const Joints& joints) const = 0;
  /// All branches within the limits. Empty when out of reach; reason then gives the cause.
  virtual std::vector<InverseSolution> inverse(const Pose& flange, std::string* reason) const = 0;
  /// Smallest singular value of the flange Jacobian scaled by the arm's reach; 0 at a singularity.
  virtual double manipulability(const Joints& joints) const = 0;
  /// d flange / d joints in the base frame, rows [translation; rotation vector].
  virtual Matrix6d jacobian(const Joints& joints) const = 0;

  const std::string& name() const { return name_; }
  const std::array<JointLimit, 6>& limits() const { return limits_; }
  bool is_linear(int joint) const { return linear_[static_cast<std::size_t>(joint)]; }
  /// Motor coordinates of the joints: on a Fanuc parallelogram joint 3's motor turns J2 + J3; the
  /// others are unchanged.
  virtual Joints motor_joints(const Joints& joints) const { return joints; }
  /// Empty when the joints are within all limits, else a sentence that names joint, value and
  /// limit.
  virtual std::string limit_violation(const Joints& joints) const = 0;
  const std::vector<ArmBody>& bodies() const { return bodies_; }

 protected:
  std::string name_;
  std::array<JointLimit, 6> limits_{};
  std::array<bool, 6> linear_{};
  std::vector<ArmBody> bodies_;
};

}  // namespace berth
