// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/gantry.h"

#include <cmath>
#include <numbers>

#include "common/core/arm_kinematics.h"
#include "common/core/text.h"

namespace berth {
namespace {

using std::numbers::pi;
constexpr std::array<const char*, 6> axis_names{"x", "y", "z", "w", "p", "r"};

Quaterniond about(const Vector3d& axis, double angle) {
  return Quaterniond(Eigen::AngleAxisd(angle, axis));
}

}  // namespace

Gantry::Gantry(Config& config) {
  for (const bool linear : {true, false}) {
    Config section = config.section(linear ? "travel" : "turn");
    const double limit =
        section.quantity("limit", linear ? Dimension::length : Dimension::angle, above(0));
    const double speed =
        section.quantity("speed", linear ? Dimension::speed : Dimension::angular_speed, above(0));
    const double acceleration = section.quantity(
        "acceleration", linear ? Dimension::acceleration : Dimension::angular_acceleration,
        above(0));
    section.finish();
    for (std::size_t i = linear ? 0 : 3; i < (linear ? 3U : 6U); ++i) {
      limits_[i] = {-limit, limit, speed, acceleration};
      linear_[i] = linear;
    }
  }
}

Pose Gantry::forward(const Joints& q) const {
  return {Vector3d(q[0], q[1], q[2]), about(Vector3d::UnitZ(), q[5]) *
                                          about(Vector3d::UnitY(), q[4]) *
                                          about(Vector3d::UnitX(), q[3])};
}

std::array<Pose, 7> Gantry::link_poses(const Joints& q) const {
  std::array<Pose, 7> links;
  links[1].position = Vector3d(q[0], 0, 0);
  links[2].position = Vector3d(q[0], q[1], 0);
  links[3].position = Vector3d(q[0], q[1], q[2]);
  links[4] = {links[3].position, about(Vector3d::UnitZ(), q[5])};
  links[5] = {links[3].position, links[4].rotation * about(Vector3d::UnitY(), q[4])};
  links[6] = forward(q);
  return links;
}

std::vector<InverseSolution> Gantry::inverse(const Pose& flange, std::string* reason) const {
  if (reason != nullptr) reason->clear();
  const Matrix3d m = flange.rotation.toRotationMatrix();
  const double cosine = std::hypot(m(0, 0), m(1, 0));
  if (cosine < 1e-9) {
    if (reason != nullptr)
      *reason = "singular: p is +-90 degrees, so that w and r turn about one axis";
    return {};
  }
  std::vector<InverseSolution> solutions;
  for (const double sign : {1.0, -1.0}) {
    InverseSolution solution;
    solution.joints = {flange.position.x(),
                       flange.position.y(),
                       flange.position.z(),
                       std::atan2(sign * m(2, 1), sign * m(2, 2)),
                       std::atan2(-m(2, 0), sign * cosine),
                       std::atan2(sign * m(1, 0), sign * m(0, 0))};
    const std::string violation = limit_violation(solution.joints);
    if (violation.empty()) {
      solutions.push_back(solution);
    } else if (reason != nullptr) {
      *reason = "out of limits: " + violation;
    }
  }
  if (reason != nullptr && !solutions.empty()) reason->clear();
  return solutions;
}

Matrix6d Gantry::jacobian(const Joints& q) const {
  Matrix6d j = Matrix6d::Zero();
  j.topLeftCorner<3, 3>().setIdentity();
  const Quaterniond r = about(Vector3d::UnitZ(), q[5]);
  j.block<3, 1>(3, 3) = r * about(Vector3d::UnitY(), q[4]) * Vector3d::UnitX();
  j.block<3, 1>(3, 4) = r * Vector3d::UnitY();
  j.block<3, 1>(3, 5) = Vector3d::UnitZ();
  return j;
}

double Gantry::manipulability(const Joints& joints) const {
  return min_singular_value(jacobian(joints));
}

std::string Gantry::limit_violation(const Joints& joints) const {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i] >= limits_[i].low && joints[i] <= limits_[i].high) continue;
    const double scale = linear_[i] ? 1.0 : 180.0 / pi;
    std::string text = axis_names[i];
    text += " = " + fixed(joints[i] * scale, 2) + (linear_[i] ? " m" : " deg");
    text += " is beyond its limits of " + fixed(limits_[i].low * scale, 2) + " to ";
    text += fixed(limits_[i].high * scale, 2);
    return text;
  }
  return "";
}

}  // namespace berth
