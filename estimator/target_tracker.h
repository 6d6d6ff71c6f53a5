// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "common/core/pose.h"

namespace berth::estimator {

struct TrackerOptions {
  double alpha = 0.8;  ///< gain of the pose
  double beta = 0.5;   ///< gain of the velocities
  /// Accelerations the target may have although the model says none: sigma.
  double linear_acceleration = 0.01;   ///< m/s^2
  double angular_acceleration = 0.01;  ///< rad/s^2
};

/// Alpha-beta filter of a pose with constant linear and angular velocity (paper, section 4.5).
/// Poses are T_sensor_model, velocities of the model's origin in the sensor frame, times in us.
class TargetTracker {
 public:
  explicit TargetTracker(const TrackerOptions& options) : options_(options) {}

  /// Starts at rest.
  void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime);
  bool started() const { return started_; }
  void stop() { started_ = false; }

  Pose predict(std::int64_t utime) const;
  /// Of predict(): what is known now, and what may have happened since.
  Matrix6d predicted_covariance(std::int64_t utime) const;
  /// Takes a measured pose in. A measurement no later than the last only corrects the pose.
  void update(const Pose& measured, const Matrix6d& covariance, std::int64_t utime);

  const Pose& pose() const { return pose_; }
  const Velocity& velocity() const { return velocity_; }
  const Matrix6d& covariance() const { return covariance_; }
  const Matrix6d& velocity_covariance() const { return velocity_covariance_; }
  std::int64_t utime() const { return utime_; }

 private:
  TrackerOptions options_;
  bool started_ = false;
  int updates_ = 0;
  std::int64_t utime_ = 0;
  Pose pose_;
  Velocity velocity_;
  Matrix6d covariance_ = Matrix6d::Identity();
  Matrix6d velocity_covariance_ = Matrix6d::Identity();
  Matrix6d cross_covariance_ = Matrix6d::Zero();  // of pose and velocity
};

}  // namespace berth::estimator
