// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>

#include "testbed/arm_pair.h"

namespace berth::testbed {

/// One reading of an arm's joints.
struct JointSample {
  std::int64_t utime = 0;
  Joints joints{};
  Joints sigma{};  ///< 1 sigma of each
};

/// Where the replica was in the sensor frame.
struct Truth {
  std::int64_t utime = 0;
  Pose pose;            ///< T_sensor_model
  Matrix6d covariance;  ///< see perturbed()
  Velocity velocity;    ///< mean over the last velocity_window, sensor frame
};

/// Interpolates both arms' reported joints to one time, on a fixed grid of time: never
/// extrapolated, and not across a gap in the readings. A grid time is given out as soon as both
/// arms have a later sample.
class GroundTruth {
 public:
  struct Settings {
    std::int64_t period = 8000;            ///< us of the grid
    std::int64_t largest_gap = 60000;      ///< us between two samples that may be bridged
    std::int64_t velocity_window = 64000;  ///< us
    double position_sigma = 1e-3;          ///< m, of the calibration, each axis
    double rotation_sigma = 3.5e-4;        ///< rad
    double time_sigma = 1e-3;              ///< s between the arms' clocks and the host's
  };
  using Publish = std::function<void(const Truth&)>;

  GroundTruth(const Cell& cell, const Settings& settings, Publish publish);

  /// Samples of one arm come in the order of their times; older ones are dropped.
  void add(ArmRole role, const JointSample& sample);
  std::int64_t skipped() const { return skipped_; }

 private:
  struct Interpolated {
    Joints joints{};
    Joints sigma{};
  };
  std::deque<JointSample>& of(ArmRole role);
  bool interpolate_at(ArmRole role, std::int64_t utime, Interpolated& result);
  void publish(std::int64_t utime, const Interpolated& replica, const Interpolated& sensor);

  const Cell& cell_;
  Settings settings_;
  Publish publish_;
  std::deque<JointSample> replica_;
  std::deque<JointSample> sensor_;
  std::deque<Truth> recent_;  // for the velocity
  std::int64_t next_ = 0;
  std::int64_t skipped_ = 0;
};

/// Covariance of T_sensor_model from independent errors of both arms' joints (1 sigma each).
Matrix6d joint_covariance(const Cell& cell, const ArmPair& joints, const ArmPair& sigma);

}  // namespace berth::testbed
