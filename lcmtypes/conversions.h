// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <berth/arm_state_t.hpp>
#include <berth/scan_window_t.hpp>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "common/core/arm_kinematics.h"
#include "common/core/lidar_profile.h"
#include "common/core/pose.h"

/// Conversions between Berth's types and the fields of messages: metres, radians, seconds;
/// quaternions w x y z; matrices row by row.
namespace berth {

/// Whether the fields hold a pose: finite, the quaternion unit to 1e-3.
inline bool is_pose(const double position_m[3], const double q_wxyz[4]) {
  const double norm = Eigen::Vector4d::Map(q_wxyz).norm();
  return Vector3d::Map(position_m).allFinite() && std::abs(norm - 1) < 1e-3;
}

/// Exact to the bit, so that a path can continue from a commanded pose; the quaternion is unit to
/// 1e-3.
inline Pose exact_pose_of(const double position_m[3], const double q_wxyz[4]) {
  return {Vector3d::Map(position_m), Quaterniond(q_wxyz[0], q_wxyz[1], q_wxyz[2], q_wxyz[3])};
}
template <class Message>
Pose exact_pose_of(const Message& message) {
  return exact_pose_of(message.position_m, message.q_wxyz);
}
/// The quaternion is normalized.
inline Pose pose_of(const double position_m[3], const double q_wxyz[4]) {
  Pose pose = exact_pose_of(position_m, q_wxyz);
  pose.rotation.normalize();
  return pose;
}
template <class Message>
Pose pose_of(const Message& message) {
  return pose_of(message.position_m, message.q_wxyz);
}

/// The same, with the quaternion's sign such that w >= 0, as in estimates.
inline Pose with_positive_w(Pose pose) {
  if (pose.rotation.w() < 0) pose.rotation.coeffs() *= -1;
  return pose;
}

inline void set_pose(const Pose& pose, double position_m[3], double q_wxyz[4]) {
  Vector3d::Map(position_m) = pose.position;
  q_wxyz[0] = pose.rotation.w();
  Vector3d::Map(q_wxyz + 1) = pose.rotation.vec();
}
template <class Message>
void set_pose(const Pose& pose, Message& message) {
  set_pose(pose, message.position_m, message.q_wxyz);
}

template <class Message>
Velocity velocity_of(const Message& message) {
  return {Vector3d::Map(message.linear_velocity_m_s),
          Vector3d::Map(message.angular_velocity_rad_s)};
}
template <class Message>
void set_velocity(const Velocity& velocity, Message& message) {
  Vector3d::Map(message.linear_velocity_m_s) = velocity.linear;
  Vector3d::Map(message.angular_velocity_rad_s) = velocity.angular;
}

/// A covariance is symmetric: the order of its values does not matter.
inline Matrix6d covariance_of(const double values[36]) { return Matrix6d::Map(values); }
inline void set_covariance(const Matrix6d& covariance, double values[36]) {
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(values, 6, 6) = covariance;
}

/// Nothing without a state, or when the arm's driver reports them as not valid.
inline std::optional<Joints> reported_joints(const std::optional<arm_state_t>& state) {
  if (!state || !state->valid) return std::nullopt;
  Joints joints{};
  std::copy(std::begin(state->reported_joint), std::end(state->reported_joint), joints.begin());
  return joints;
}

inline std::vector<Window> windows_of(const std::vector<scan_window_t>& messages) {
  std::vector<Window> windows;
  for (const scan_window_t& w : messages) {
    windows.push_back({w.azimuth_rad, w.elevation_rad, w.width_rad, w.height_rad,
                       static_cast<Pattern>(w.pattern), w.count, w.spacing_rad, w.name});
  }
  return windows;
}
inline std::vector<scan_window_t> messages_of(const std::vector<Window>& windows) {
  std::vector<scan_window_t> messages;
  for (const Window& w : windows) {
    scan_window_t& message = messages.emplace_back();
    message.azimuth_rad = w.azimuth;
    message.elevation_rad = w.elevation;
    message.width_rad = w.width;
    message.height_rad = w.height;
    message.pattern = static_cast<std::int8_t>(w.pattern);
    message.count = w.count;
    message.spacing_rad = w.spacing;
    message.name = w.name;
  }
  return messages;
}

}  // namespace berth
