// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/node/chaser_motion.h"

#include <cmath>

namespace berth::testbed {
namespace {

// us
constexpr std::int64_t interval = 50000;
constexpr std::int64_t largest_gap = 100000;
/// 1 sigma, each axis, of the arms' deviation from commands over a second.
constexpr double velocity_sigma = 0.001;                  // m/s
constexpr double angular_velocity_sigma = radians(0.02);  // rad/s

}  // namespace

std::optional<inertial_motion_t> ChaserMotion::add(std::int64_t utime, const Pose& commanded) {
  const Pose sensor = commanded.inverse();
  const std::int64_t since = utime_;
  const std::optional<Pose> before = sensor_;
  utime_ = utime;
  sensor_ = sensor;
  if (!before || utime <= since || utime - since > largest_gap) {
    reported_.reset();
    return std::nullopt;
  }
  const Velocity mean =
      velocity_between(*before, sensor, 1e-6 * static_cast<double>(utime - since));
  const Quaterniond to_sensor = sensor.rotation.conjugate();
  const Moving now{since + (utime - since) / 2, {mean.linear, to_sensor * mean.angular}};
  if (!reported_) {
    reported_ = now;
    return std::nullopt;
  }
  if (now.utime - reported_->utime < interval) return std::nullopt;
  inertial_motion_t message{};
  message.utime = now.utime;
  message.interval_us = now.utime - reported_->utime;
  const double root = std::sqrt(1e-6 * static_cast<double>(message.interval_us));
  Eigen::Map<Vector3d>(message.velocity_change_m_s) =
      to_sensor * (now.velocity.linear - reported_->velocity.linear);
  Eigen::Map<Vector3d>(message.angular_velocity_rad_s) = now.velocity.angular;
  Eigen::Map<Vector3d>(message.angular_velocity_change_rad_s) =
      now.velocity.angular - reported_->velocity.angular;
  message.velocity_change_sigma_m_s = root * velocity_sigma;
  message.angular_velocity_change_sigma_rad_s = root * angular_velocity_sigma;
  reported_ = now;
  return message;
}

}  // namespace berth::testbed
