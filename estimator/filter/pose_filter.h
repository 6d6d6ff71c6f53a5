// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/filter/target_tracker.h"

namespace berth::estimator {

struct PoseFilterOptions {
  /// White acceleration of the target against the sensor, which the model does not know: the
  /// standard deviation of its velocity after one second.
  double linear_acceleration = 0.01;   ///< m/s per square root of a second
  double angular_acceleration = 0.01;  ///< rad/s per square root of a second
  /// What a target that has only been seen once may do, 1 sigma.
  double unknown_speed = 0.05;     ///< m/s
  double unknown_rotation = 0.05;  ///< rad/s
  /// A measured pose farther from the prediction, in standard deviations of both, is doubted: its
  /// covariance is widened. 6 degrees of freedom: 4.7 in one of 1,000.
  double surprise_sigmas = 4.7;
};

/// Error-state Kalman filter of pose and velocity on SE(3) with constant linear and angular
/// velocity. The error is a left perturbation: p + d, Exp(r) R, and v + dv, w + dw, all in the
/// sensor frame (Sola, "Quaternion kinematics for the error-state Kalman filter", 2017). Updates in
/// information form over the factor L of the covariance P = L L': the posterior is
/// L (1 + L' H L)^-1 L', symmetric and positive whatever the information H.
///
/// Errors that scans have in common, as of the surface where it is not as the mesh says, are a
/// consider state [Schmidt, Advances in Control Systems 3 (1966) 293]: a shift c of what scans
/// measure, not estimated, whose covariance C and covariance with the motion are kept. So filtered
/// covariances do not fall below what the surface does to a pose. As the target is seen from
/// another direction, c changes: of a convex body a share 1 - angle / pi of what is seen is seen
/// from both; so much correlation is left.
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
  void carry(const SensorMotion& sensor, std::int64_t until) override;

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
  double doubt(const Pose& measured, const Matrix6d& covariance, std::int64_t utime);
  template <class Source>
  bool take_in(const Source& returns, std::int64_t utime);
  bool take_in_considering(const MeasuredMotion& motion, double factor, std::int64_t utime);
  template <class Update>
  bool or_unchanged(Update update);
  void set_covariance(const Matrix12d& covariance);
  void accelerate(const SensorMotion& sensor, double dt);

  PoseFilterOptions options_;
  bool started_ = false;
  int probable_ = 0;  // measurements in a row
  std::int64_t utime_ = 0;
  Motion motion_;
  Matrix12d covariance_ = Matrix12d::Identity();
  // Of the motion with w, where c = S w, C = S S', and w has unit covariance.
  Matrix12d with_considered_ = Matrix12d::Zero();
  Vector3d seen_from_ = Vector3d::Zero();  // when c was last met: unit, model frame
  Matrix6d pose_covariance_ = Matrix6d::Identity();
  Matrix6d velocity_covariance_ = Matrix6d::Identity();
};

}  // namespace berth::estimator
