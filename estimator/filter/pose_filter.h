// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/filter/target_tracker.h"

namespace berth::estimator {

struct PoseFilterOptions {
  /// White noise acceleration of the target relative to the sensor: the standard deviation of the
  /// velocity after one second.
  double linear_acceleration = 0.01;   ///< m/s per square root of a second
  double angular_acceleration = 0.01;  ///< rad/s per square root of a second
  /// Prior of the velocity after the first measurement, 1 sigma.
  double unknown_speed = 0.05;     ///< m/s
  double unknown_rotation = 0.05;  ///< rad/s
  /// Innovation gate, in standard deviations: beyond it a measurement's covariance is inflated.
  /// With six degrees of freedom 4.7 is exceeded with probability 0.001.
  double surprise_sigmas = 4.7;
};

/// Error-state Kalman filter of pose and velocity on SO(3) x R3 with constant linear and angular
/// velocity. The error is a left perturbation: p + d, Exp(r) R, v + dv, w + dw, all in the sensor
/// frame (Sola, "Quaternion kinematics for the error-state Kalman filter", 2017). Updates are in
/// information form over the Cholesky factor L of the covariance P = L L': the posterior
///   P+ = L (1 + L' H L)^-1 L'
/// is symmetric and positive for any information H.
///
/// Errors that scans share, such as the surface's departure from the mesh, are a consider state
/// [Schmidt, Advances in Control Systems 3 (1966) 293]: a shift c of the measured motion with
/// covariance C. It is not estimated; C and its covariance with the motion are kept, so that
/// filtered covariances do not fall below the surface's contribution. c decorrelates as the view
/// changes: of a convex body seen from directions an angle apart, the share 1 - angle / pi of the
/// surface is seen from both, and that is the correlation kept.
class PoseFilter final : public TargetTracker {
 public:
  explicit PoseFilter(const PoseFilterOptions& options) : options_(options) {}
  std::unique_ptr<TargetTracker> clone() const override {
    return std::make_unique<PoseFilter>(*this);
  }

  void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) override;
  void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime,
             const Velocity& velocity, const Matrix6d& velocity_covariance) override;
  void stop() override { started_ = false; }
  bool started() const override { return started_; }

  Pose predict(std::int64_t utime) const override;
  Matrix6d predicted_covariance(std::int64_t utime) const override;
  Matrix6d predicted_velocity_covariance(std::int64_t utime) const override;
  bool update(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) override;
  bool update(const Pose& measured, const Matrix6d& covariance, const MeasuredMotion& motion,
              std::int64_t utime) override;
  void propagate(const SensorMotion& sensor, std::int64_t until) override;

  const Pose& pose() const override { return motion_.pose; }
  const Velocity& velocity() const override { return motion_.velocity; }
  const Matrix6d& covariance() const override { return pose_covariance_; }
  const Matrix6d& velocity_covariance() const override { return velocity_covariance_; }
  std::int64_t utime() const override { return utime_; }
  /// Of [translation; rotation; linear; angular velocity].
  const Matrix12d& full_covariance() const { return covariance_; }

 private:
  Matrix12d covariance_at(std::int64_t utime) const;
  void advance(std::int64_t utime);
  double inflation(const Pose& measured, const Matrix6d& covariance, std::int64_t utime);
  template <class Source>
  bool iterated_update(const Source& returns, std::int64_t utime);
  bool schmidt_update(const MeasuredMotion& motion, double factor, std::int64_t utime);
  template <class Update>
  bool or_restore(Update update);
  void set_covariance(const Matrix12d& covariance);
  void apply_sensor_acceleration(const SensorMotion& sensor, double dt);

  PoseFilterOptions options_;
  bool started_ = false;
  int consistent_ = 0;  // measurements within the innovation gate, in a row
  std::int64_t utime_ = 0;
  Motion motion_;
  Matrix12d covariance_ = Matrix12d::Identity();
  // Covariance of the motion with w, where c = S w, C = S S', and w has unit covariance.
  Matrix12d consider_cross_ = Matrix12d::Zero();
  Vector3d view_direction_ = Vector3d::Zero();  // of the last measurement with c: unit, model frame
  Matrix6d pose_covariance_ = Matrix6d::Identity();
  Matrix6d velocity_covariance_ = Matrix6d::Identity();
};

}  // namespace berth::estimator
