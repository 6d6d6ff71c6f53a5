// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/filter/target_tracker.h"

namespace berth::estimator {

struct AlphaBetaOptions {
  double alpha = 0.8;  ///< gain of the pose
  double beta = 0.5;   ///< gain of the velocities
  /// Unmodelled acceleration of the target, 1 sigma.
  double linear_acceleration = 0.01;   ///< m/s^2
  double angular_acceleration = 0.01;  ///< rad/s^2
};

/// Alpha-beta filter of a pose with constant linear and angular velocity (paper, section 4.5).
class AlphaBetaTracker final : public TargetTracker {
 public:
  explicit AlphaBetaTracker(const AlphaBetaOptions& options) : options_(options) {}
  std::unique_ptr<TargetTracker> clone() const override {
    return std::make_unique<AlphaBetaTracker>(*this);
  }

  void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) override;
  void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime,
             const Velocity& velocity, const Matrix6d& velocity_covariance) override;
  void stop() override { started_ = false; }
  bool started() const override { return started_; }

  Pose predict(std::int64_t utime) const override;
  Matrix6d predicted_covariance(std::int64_t utime) const override;
  Matrix6d predicted_velocity_covariance(std::int64_t utime) const override;
  using TargetTracker::update;
  bool update(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) override;

  const Pose& pose() const override { return pose_; }
  const Velocity& velocity() const override { return velocity_; }
  const Matrix6d& covariance() const override { return covariance_; }
  const Matrix6d& velocity_covariance() const override { return velocity_covariance_; }
  std::int64_t utime() const override { return utime_; }

 private:
  AlphaBetaOptions options_;
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
