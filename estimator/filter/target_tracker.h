// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "common/core/pose.h"

namespace berth::estimator {

/// Keeps the target's pose between measurements (paper, section 4.5, Figure 4). Poses are
/// T_sensor_model, velocities of the model's origin in the sensor frame, times in us.
class TargetTracker {
 public:
  virtual ~TargetTracker() = default;

  /// Starts at rest.
  virtual void start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) = 0;
  virtual void stop() = 0;
  virtual bool started() const = 0;

  virtual Pose predict(std::int64_t utime) const = 0;
  /// Of predict(): what is known now, and what may have happened since.
  virtual Matrix6d predicted_covariance(std::int64_t utime) const = 0;
  /// Takes a measured pose in. A measurement no later than the last only corrects the pose.
  virtual void update(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) = 0;

  virtual const Pose& pose() const = 0;
  virtual const Velocity& velocity() const = 0;
  virtual const Matrix6d& covariance() const = 0;
  virtual const Matrix6d& velocity_covariance() const = 0;
  /// Of the last measurement.
  virtual std::int64_t utime() const = 0;
};

}  // namespace berth::estimator
