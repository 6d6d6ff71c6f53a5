// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>

#include "common/core/cell.h"
#include "testbed/truth/truth_covariance.h"

namespace berth::testbed {

/// One reading of an arm's joints.
struct JointSample {
  std::int64_t utime = 0;
  Joints joints{};
  Joints sigma{};         ///< 1 sigma of each
  double time_sigma = 0;  ///< s, of utime
};

/// Where the replica was in the sensor frame.
struct Truth {
  std::int64_t utime = 0;
  Pose pose;            ///< T_sensor_model
  Matrix6d covariance;  ///< see perturbed()
  Velocity velocity;    ///< mean over the last velocity_window, sensor frame
};

/// Interpolates both arms' reported joints to one time, on a fixed grid of time: never
/// extrapolated, and not across a gap in the readings. A grid time is published as soon as both
/// arms have a later sample.
///
/// Its covariance is the sum of independent contributions: the calibration; each encoder; the time
/// of each arm's readings, times its joints' velocity; and the motion between two readings, which a
/// straight line misses by a s (1 - s) h^2 / 2 at the share s of the gap h, with the acceleration a
/// that this and the reading before show.
class GroundTruth {
 public:
  struct Settings {
    std::int64_t period = 8000;            ///< us of the grid
    std::int64_t largest_gap = 60000;      ///< us between two samples that may be bridged
    std::int64_t velocity_window = 64000;  ///< us
  };
  using Publish = std::function<void(const Truth&)>;

  /// Cell, calibrated, and calibration must outlive it.
  GroundTruth(const Cell& cell, const Calibration& calibration, const Settings& settings,
              Publish publish);

  /// Samples of one arm come in the order of their times; older ones are dropped.
  void add(ArmRole role, const JointSample& sample);
  std::int64_t skipped() const { return skipped_; }

 private:
  std::deque<JointSample>& of(ArmRole role);
  bool interpolate_at(ArmRole role, std::int64_t utime, ArmMoment& result);
  void publish(std::int64_t utime, const ArmMoment& replica, const ArmMoment& sensor);

  RelativePose relative_pose_;
  TruthCovariance covariance_;
  Settings settings_;
  Publish publish_;
  std::deque<JointSample> replica_;
  std::deque<JointSample> sensor_;
  std::deque<Truth> recent_;  // for the velocity
  std::int64_t next_ = 0;
  std::int64_t skipped_ = 0;
};

}  // namespace berth::testbed
