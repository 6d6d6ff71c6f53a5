// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/pose.h"

#include <cmath>

namespace berth {

Pose Pose::operator*(const Pose& other) const {
  return {rotation * other.position + position, rotation * other.rotation};
}

Pose Pose::inverse() const {
  const Quaterniond back = rotation.conjugate();
  return {-(back * position), back};
}

Eigen::Isometry3d Pose::isometry() const {
  Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
  t.linear() = rotation.toRotationMatrix();
  t.translation() = position;
  return t;
}

Quaterniond rotation_from_vector(const Vector3d& v) {
  // cos(a/2) and sin(a/2)/a; of small angles by their series, exact to all digits and faster.
  const double square = 0.25 * v.squaredNorm();
  double cosine = 1 - square * (1.0 / 2 - square * (1.0 / 24 - square / 720));
  double scale = 0.5 * (1 - square * (1.0 / 6 - square * (1.0 / 120 - square / 5040)));
  constexpr double small = 1e-3;  // of the square: the terms left out are below 1e-16
  if (square > small) {
    const double half = std::sqrt(square);
    cosine = std::cos(half);
    scale = 0.5 * std::sin(half) / half;
  }
  return Quaterniond(cosine, scale * v.x(), scale * v.y(), scale * v.z()).normalized();
}

Vector3d rotation_vector(const Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Vector3d v = sign * q.vec();
  const double sine = v.norm();
  if (sine < 1e-9) return 2.0 * v;
  return v * (2.0 * std::atan2(sine, sign * q.w()) / sine);
}

Matrix3d skew(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Pose perturbed(const Pose& pose, const Vector6d& d) {
  return {pose.position + d.head<3>(),
          (rotation_from_vector(d.tail<3>()) * pose.rotation).normalized()};
}

Vector6d difference(const Pose& from, const Pose& to) {
  Vector6d d;
  d << to.position - from.position, rotation_vector(to.rotation * from.rotation.conjugate());
  return d;
}

Pose interpolate(const Pose& a, const Pose& b, double s) {
  return perturbed(a, s * difference(a, b));
}

Pose moved(const Pose& pose, const Velocity& velocity, double dt) {
  Vector6d d;
  d << velocity.linear * dt, velocity.angular * dt;
  return perturbed(pose, d);
}

Velocity velocity_between(const Pose& a, const Pose& b, double dt) {
  const Vector6d d = difference(a, b) / dt;
  return {d.head<3>(), d.tail<3>()};
}

double distance(const Pose& a, const Pose& b) { return (b.position - a.position).norm(); }

double angle_between(const Pose& a, const Pose& b) { return difference(a, b).tail<3>().norm(); }

Pose pose_from_xyzwpr(const Xyzwpr& v) {
  using Eigen::AngleAxisd;
  return {Vector3d(v[0], v[1], v[2]) * 1e-3,
          Quaterniond(AngleAxisd(radians(v[5]), Vector3d::UnitZ()) *
                      AngleAxisd(radians(v[4]), Vector3d::UnitY()) *
                      AngleAxisd(radians(v[3]), Vector3d::UnitX()))};
}

Xyzwpr xyzwpr_from_pose(const Pose& pose) {
  const Matrix3d r = pose.rotation.toRotationMatrix();
  double w_angle = 0;
  double r_angle = 0;
  const double cos_p = std::hypot(r(0, 0), r(1, 0));
  const double p_angle = std::atan2(-r(2, 0), cos_p);
  if (cos_p > 1e-9) {
    w_angle = std::atan2(r(2, 1), r(2, 2));
    r_angle = std::atan2(r(1, 0), r(0, 0));
  } else {
    r_angle = std::atan2(-r(0, 1), r(1, 1));
  }
  return {pose.position.x() * 1e3, pose.position.y() * 1e3, pose.position.z() * 1e3,
          degrees(w_angle),        degrees(p_angle),        degrees(r_angle)};
}

}  // namespace berth
