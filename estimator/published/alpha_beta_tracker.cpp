// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/alpha_beta_tracker.h"

#include <algorithm>

#include "common/core/covariance.h"

namespace berth::estimator {

namespace {

/// Symmetric to the last bit.
Matrix6d symmetric(const Matrix6d& m) { return 0.5 * (m + m.transpose()); }

// Prior of the velocity after the first measurement, 1 sigma.
constexpr double unknown_speed = 0.05;     // m/s
constexpr double unknown_rotation = 0.05;  // rad/s

}  // namespace

void AlphaBetaTracker::start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) {
  Vector6d variance;
  variance << Vector3d::Constant(unknown_speed * unknown_speed),
      Vector3d::Constant(unknown_rotation * unknown_rotation);
  start(pose, covariance, utime, {}, variance.asDiagonal());
  updates_ = 0;
}

void AlphaBetaTracker::start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime,
                             const Velocity& velocity, const Matrix6d& velocity_covariance) {
  started_ = true;
  updates_ = 2;  // a known velocity counts as two poses
  utime_ = utime;
  pose_ = pose;
  velocity_ = velocity;
  covariance_ = covariance;
  cross_covariance_.setZero();
  velocity_covariance_ = velocity_covariance;
}

Pose AlphaBetaTracker::predict(std::int64_t utime) const {
  return moved(pose_, velocity_, elapsed(utime_, utime));
}

Matrix6d AlphaBetaTracker::predicted_covariance(std::int64_t utime) const {
  const double dt = elapsed(utime_, utime);
  Vector6d acceleration;
  acceleration << Vector3d::Constant(options_.linear_acceleration),
      Vector3d::Constant(options_.angular_acceleration);
  const Vector6d drift = 0.5 * dt * dt * acceleration;
  return symmetric(covariance_ + dt * (cross_covariance_ + cross_covariance_.transpose()) +
                   dt * dt * velocity_covariance_ + Matrix6d(drift.cwiseAbs2().asDiagonal()));
}

Matrix6d AlphaBetaTracker::predicted_velocity_covariance(std::int64_t utime) const {
  Vector6d change;
  change << Vector3d::Constant(options_.linear_acceleration),
      Vector3d::Constant(options_.angular_acceleration);
  change *= elapsed(utime_, utime);
  return velocity_covariance_ + Matrix6d(change.cwiseAbs2().asDiagonal());
}

bool AlphaBetaTracker::update(const Pose& measured, const Matrix6d& covariance,
                              std::int64_t utime) {
  const double dt = elapsed(utime_, utime);
  const Pose predicted = predict(utime);
  const Vector6d innovation = difference(predicted, measured);
  if (!innovation.allFinite() || !is_covariance(covariance)) return false;

  // The first updates have the gains of a least-squares line through the poses so far: the initial
  // velocity is unknown.
  ++updates_;
  const double n = updates_ + 1;
  const double alpha = std::max(options_.alpha, 2 * (2 * n - 1) / (n * (n + 1)));
  const double beta = dt > 0 ? std::max(options_.beta, 6 / (n * (n + 1))) / dt : 0;

  // The covariance of x = [pose; velocity] under x' = F x + G (z - H F x) with these gains.
  const double drift = 0.5 * dt * dt;
  Vector6d q;  // variances of the acceleration
  q << Vector3d::Constant(options_.linear_acceleration * options_.linear_acceleration),
      Vector3d::Constant(options_.angular_acceleration * options_.angular_acceleration);
  const Matrix6d acceleration = q.asDiagonal();
  const Matrix6d p = covariance_ + dt * (cross_covariance_ + cross_covariance_.transpose()) +
                     dt * dt * velocity_covariance_ + drift * drift * acceleration;
  const Matrix6d c = cross_covariance_ + dt * velocity_covariance_ + drift * dt * acceleration;
  const Matrix6d v = velocity_covariance_ + dt * dt * acceleration;
  covariance_ = symmetric((1 - alpha) * (1 - alpha) * p + alpha * alpha * covariance);
  cross_covariance_ = (1 - alpha) * (c - beta * p) + alpha * beta * covariance;
  velocity_covariance_ = symmetric(v - beta * (c + c.transpose()) + beta * beta * (p + covariance));

  pose_ = perturbed(predicted, alpha * innovation);
  velocity_.linear += beta * innovation.head<3>();
  velocity_.angular += beta * innovation.tail<3>();
  utime_ = std::max(utime_, utime);
  return true;
}

}  // namespace berth::estimator
