// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "common/core/pose.h"
#include "estimator/filter/motion_information.h"
#include "estimator/filter/sensor_motion.h"

namespace berth::estimator {

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
