// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace berth {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A rigid transformation. Named T_a_b where it maps coordinates in frame b to frame a:
/// p_a = T_a_b * p_b, and T_a_c = T_a_b * T_b_c. Metres; the quaternion is unit.
struct Pose {
  Vector3d position = Vector3d::Zero();
  Quaterniond rotation = Quaterniond::Identity();

  Vector3d operator*(const Vector3d& point) const { return rotation * point + position; }
  Pose operator*(const Pose& other) const;
  Pose inverse() const;
  Eigen::Isometry3d isometry() const;
};

/// Linear (m/s) and angular (rad/s) velocity of a frame's origin and body, both in one named frame.
struct Velocity {
  Vector3d linear = Vector3d::Zero();
  Vector3d angular = Vector3d::Zero();
};

/// Rotation by |v| radians about v. Exact to first order at zero.
Quaterniond rotation_from_vector(const Vector3d& v);
/// Inverse of rotation_from_vector; the angle is in [0, pi].
Vector3d rotation_vector(const Quaterniond& q);
/// Matrix [v]x with [v]x w = v cross w.
Matrix3d skew(const Vector3d& v);

/// The perturbed pose: position + d[0..2], Exp(d[3..5]) * rotation. This is the perturbation to
/// which every 6x6 covariance of Berth refers: [translation (m); rotation vector (rad)] in the
/// outer frame.
Pose perturbed(const Pose& pose, const Vector6d& d);
/// d with perturbed(from, d) == to.
Vector6d difference(const Pose& from, const Pose& to);

/// Pose at fraction s of the way from a to b: position on the straight line, rotation about one
/// axis at constant rate. s outside [0, 1] extrapolates.
Pose interpolate(const Pose& a, const Pose& b, double s);
/// Pose after moving for dt seconds with a constant velocity given in the outer frame.
Pose moved(const Pose& pose, const Velocity& velocity, double dt);
/// Mean velocity, in the outer frame, that carries a to b in dt seconds (dt != 0).
Velocity velocity_between(const Pose& a, const Pose& b, double dt);

/// Position error |b - a| in metres, and angle between the rotations in radians.
double distance(const Pose& a, const Pose& b);
double angle_between(const Pose& a, const Pose& b);

/// x y z w p r as a Fanuc pendant shows them: millimetres and degrees, R = Rz(r) Ry(p) Rx(w).
/// Never difference or interpolate w, p, r: at p = +-90 they jump.
using Xyzwpr = std::array<double, 6>;
Pose pose_from_xyzwpr(const Xyzwpr& xyzwpr);
/// w and r in (-180, 180], p in [-90, 90]; at p = +-90, w is 0.
Xyzwpr xyzwpr_from_pose(const Pose& pose);

constexpr double degrees(double radians) { return radians * (180.0 / 3.14159265358979323846); }
constexpr double radians(double degrees) { return degrees * (3.14159265358979323846 / 180.0); }

}  // namespace berth
