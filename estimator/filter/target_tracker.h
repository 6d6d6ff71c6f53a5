// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <memory>

#include "common/core/pose.h"

namespace berth::estimator {

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

/// The target's motion at one time: pose T_sensor_model and velocity, sensor frame.
struct Motion {
  Pose pose;
  Velocity velocity;
};

/// By d = [translation; rotation vector (as berth::perturbed); linear; angular velocity].
Motion perturbed(const Motion& motion, const Vector12d& d);
/// The d of perturbed() that leads from one to the other.
Vector12d difference(const Motion& from, const Motion& to);

/// What a batch of returns says of the motion at a reference time: their log-likelihood to second
/// order about a linearisation point, log L(d) = gradient.d - d.information.d / 2, in the d of
/// perturbed().
struct MotionInformation {
  Matrix12d information = Matrix12d::Zero();
  Vector12d gradient = Vector12d::Zero();
  int returns = 0;  ///< that said something
};

/// What the returns of one time say of the motion then, and about which motion that is linearised.
struct MeasuredMotion {
  Motion about;
  MotionInformation said;
  /// Of the covariance of said.gradient at the true motion, which is said.information, the part of
  /// errors that the next scan has, too: of the surface, of the range's bias. Zero: none.
  Matrix12d systematic = Matrix12d::Zero();
};

class TargetTracker;

/// How the sensor itself moved between two times (us), against a frame that neither turns nor
/// accelerates, in the sensor's own axes: means over the interval.
struct SensorMotion {
  std::int64_t begin = 0;
  std::int64_t end = 0;
  Vector3d acceleration = Vector3d::Zero();          ///< m/s^2, of its origin
  Vector3d angular_velocity = Vector3d::Zero();      ///< rad/s
  Vector3d angular_acceleration = Vector3d::Zero();  ///< rad/s^2
  /// 1 sigma, each axis, of the velocities' changes over the interval.
  double velocity_sigma = 0;          ///< m/s
  double angular_velocity_sigma = 0;  ///< rad/s
};

/// The sensor's motion, one interval after the other, as far as it was told and is still needed.
class SensorMotions {
 public:
  /// Intervals that are empty, or begin before the end of one that is known, are passed over.
  void take(const SensorMotion& motion);
  /// Carries a tracker from its own time on to another. @return seconds of that way that are known.
  double carry(TargetTracker& tracker, std::int64_t until) const;
  /// Nobody will ask for what was before.
  void forget_before(std::int64_t utime);

 private:
  std::deque<SensorMotion> motions_;  // in the order of their times, none touching another
};

/// Seconds between two times in us.
inline double elapsed(std::int64_t from, std::int64_t to) {
  return static_cast<double>(to - from) * 1e-6;
}

/// Keeps the target's pose between measurements (paper, section 4.5, Figure 4). Poses are
/// T_sensor_model, velocities of the model's origin in the sensor frame, times in us.
class TargetTracker {
 public:
  virtual ~TargetTracker() = default;
  virtual std::unique_ptr<TargetTracker> clone() const = 0;

  /// Starts at rest: about the velocity nothing is known but that it is small.
  virtual void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) = 0;
  /// Starts with a motion that is known; velocity_covariance: of [linear; angular].
  virtual void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime,
                     const Velocity& velocity, const Matrix6d& velocity_covariance) = 0;
  virtual void stop() = 0;
  virtual bool started() const = 0;

  virtual Pose predict(std::int64_t utime) const = 0;
  /// Of predict(): what is known now, and what may have happened since.
  virtual Matrix6d predicted_covariance(std::int64_t utime) const = 0;
  /// Of velocity() then.
  virtual Matrix6d predicted_velocity_covariance(std::int64_t utime) const = 0;
  /// Takes a measured pose in. A measurement no later than the last only corrects the pose.
  /// @return false, and nothing has changed, when the pose is not finite, its covariance is none,
  /// or the filter's own has become singular.
  [[nodiscard]] virtual bool update(const Pose& measured, const Matrix6d& covariance,
                                    std::int64_t utime) = 0;
  /// The same where the returns' information on the velocity is known, too.
  [[nodiscard]] virtual bool update(const Pose& measured, const Matrix6d& covariance,
                                    const MeasuredMotion&, std::int64_t utime) {
    return update(measured, covariance, utime);
  }
  /// Goes on to a time (not beyond the motion's end) as the sensor itself has moved. For a tracker
  /// that knows no such input nothing changes.
  virtual void carry(const SensorMotion&, std::int64_t) {}

  virtual const Pose& pose() const = 0;
  virtual const Velocity& velocity() const = 0;
  virtual const Matrix6d& covariance() const = 0;
  virtual const Matrix6d& velocity_covariance() const = 0;
  /// Of the last measurement, or to which carry() has led.
  virtual std::int64_t utime() const = 0;
};

}  // namespace berth::estimator
