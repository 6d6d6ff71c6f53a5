// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth::testbed {

/// Where the target is and how it moves, from poses seen now and then: for position and attitude
/// each a Kalman filter of value and rate, the same for the three axes, with white acceleration.
/// Between measurements and beyond the last one the target goes on at its rates.
class TargetFilter {
 public:
  struct Settings {
    double acceleration = 0.02;          ///< m/s^2 from one second to the next
    double angular_acceleration = 0.01;  ///< rad/s^2 likewise
  };
  /// A pose at a time; sigmas of each axis, m and rad.
  struct Seen {
    double time = 0;  ///< s
    Pose pose;
    double position_sigma = 0.005;
    double rotation_sigma = 0.005;
    bool attitude_known = true;
  };

  /// The target at first sight, taken to be at rest.
  TargetFilter(const Settings& settings, const Seen& first);

  /// What is seen against what was expected, m and rad, outer frame.
  Vector6d innovation(const Seen& seen) const;
  /// Not before those seen before.
  void add(const Seen& seen);

  Pose at(double time) const { return moved(pose_, velocity_, time - time_); }
  const Velocity& velocity() const { return velocity_; }  ///< outer frame

 private:
  /// Covariance of value and rate of one axis.
  struct Spread {
    double value = 0, both = 0, rate = 0;
    void predict(double dt, double noise);
    /// Gains of value and rate for a measurement of this variance.
    Eigen::Vector2d update(double variance);
  };

  Settings settings_;
  double time_;
  Pose pose_;
  Velocity velocity_;
  Spread position_;
  Spread rotation_;
};

}  // namespace berth::testbed
