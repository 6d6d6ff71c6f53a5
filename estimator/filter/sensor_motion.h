// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>

#include "common/core/pose.h"

namespace berth::estimator {

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

}  // namespace berth::estimator
