// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <memory>

#include "common/core/pose.h"

namespace berth::estimator {

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

/// The target's pose T_sensor_model and velocity at one time, sensor frame.
struct Motion {
  Pose pose;
  Velocity velocity;
};

/// Perturbed by d = [translation; rotation vector (as berth::perturbed); linear velocity; angular
/// velocity].
Motion perturbed(const Motion& motion, const Vector12d& d);
/// The d of perturbed() that leads from `from` to `to`.
Vector12d difference(const Motion& from, const Motion& to);

/// Log-likelihood of a batch of returns as a function of the motion, to second order about a
/// linearisation point: log L(d) = gradient.d - d.information.d / 2, in the d of perturbed().
struct MotionInformation {
  Matrix12d information = Matrix12d::Zero();
  Vector12d gradient = Vector12d::Zero();
  int returns = 0;  ///< that contribute
};

/// The measurement of the motion by the returns of one scan, and the motion about which it is
/// linearised.
struct MeasuredMotion {
  Motion reference;
  MotionInformation measurement;
  /// The part of the covariance of measurement.gradient at the true motion (which is
  /// measurement.information) that is made by errors shared with the next scan: the surface's and
  /// the range bias. Zero: none.
  Matrix12d systematic = Matrix12d::Zero();
};

class TargetTracker;

/// Inertial motion of the sensor between two times (us), against a frame that neither turns nor
/// accelerates, in the sensor's axes: means over the interval.
struct SensorMotion {
  std::int64_t begin = 0;
  std::int64_t end = 0;
  Vector3d acceleration = Vector3d::Zero();          ///< m/s^2, of its origin
  Vector3d angular_velocity = Vector3d::Zero();      ///< rad/s
  Vector3d angular_acceleration = Vector3d::Zero();  ///< rad/s^2
  /// 1 sigma, each axis, of the changes of velocity over the interval.
  double velocity_sigma = 0;          ///< m/s
  double angular_velocity_sigma = 0;  ///< rad/s
};

/// A buffer of the sensor's motion, interval by interval.
class SensorMotions {
 public:
  /// Empty intervals, and those that overlap the last one, are ignored.
  void add(const SensorMotion& motion);
  /// Propagates a tracker from its own time to another. @return seconds of that interval with known
  /// sensor motion.
  double propagate(TargetTracker& tracker, std::int64_t until) const;
  /// Drops intervals that end before this time.
  void forget_before(std::int64_t utime);

 private:
  std::deque<SensorMotion> motions_;  // in the order of their times, none touching another
};

/// Seconds between two times in us.
inline double elapsed(std::int64_t from, std::int64_t to) {
  return static_cast<double>(to - from) * 1e-6;
}

/// Keeps the target's pose between measurements (paper, section 4.5, Figure 4). Poses are
/// T_sensor_model, velocities those of the model's origin in the sensor frame, times in us.
class TargetTracker {
 public:
  virtual ~TargetTracker() = default;
  virtual std::unique_ptr<TargetTracker> clone() const = 0;

  /// Starts with zero velocity of the method's prior covariance.
  virtual void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) = 0;
  /// Starts with a known motion; velocity_covariance: of [linear; angular].
  virtual void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime,
                     const Velocity& velocity, const Matrix6d& velocity_covariance) = 0;
  virtual void stop() = 0;
  virtual bool started() const = 0;

  virtual Pose predict(std::int64_t utime) const = 0;
  /// Covariance of predict(), process noise included.
  virtual Matrix6d predicted_covariance(std::int64_t utime) const = 0;
  /// Covariance of velocity() at that time.
  virtual Matrix6d predicted_velocity_covariance(std::int64_t utime) const = 0;
  /// Updates with a measured pose. A measurement no later than the last one corrects the pose only.
  /// @return false, and the tracker is unchanged, when the pose is not finite, the covariance is
  /// not positive definite, or the filter's own has become singular.
  [[nodiscard]] virtual bool update(const Pose& measured, const Matrix6d& covariance,
                                    std::int64_t utime) = 0;
  /// The same with the returns' information on the velocity.
  [[nodiscard]] virtual bool update(const Pose& measured, const Matrix6d& covariance,
                                    const MeasuredMotion&, std::int64_t utime) {
    return update(measured, covariance, utime);
  }
  /// Propagates to a time (no later than the motion's end) with the sensor's own motion as input.
  /// Trackers without that input ignore it.
  virtual void propagate(const SensorMotion&, std::int64_t) {}

  virtual const Pose& pose() const = 0;
  virtual const Velocity& velocity() const = 0;
  virtual const Matrix6d& covariance() const = 0;
  virtual const Matrix6d& velocity_covariance() const = 0;
  /// Of the last measurement or propagate().
  virtual std::int64_t utime() const = 0;
};

}  // namespace berth::estimator
