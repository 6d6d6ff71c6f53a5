// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/inertial_motion_t.hpp>
#include <functional>
#include <optional>

#include "common/bus/loop.h"
#include "common/core/pose.h"
#include "common/core/random.h"

namespace berth {

/// The chaser's inertial unit, beside the sensor: what it measures of the sensor's own motion, with
/// gravity taken out, biases and noise of its own.
class SimulatedInertial {
 public:
  struct Options {
    bool publish = false;
    Utime period = 10 * millisecond;
    /// 1 sigma, each axis, drawn once a run.
    double acceleration_bias = 0;  ///< m/s^2
    double turn_rate_bias = 0;     ///< rad/s
    /// 1 sigma, each axis, of what the changes of a second add up to.
    double velocity_noise = 0;   ///< m/s
    double turn_rate_noise = 0;  ///< rad/s
  };
  /// T_cell_sensor, truly, at a time of the last half second up to now.
  using SensorPose = std::function<Pose(Utime)>;
  using Publish = std::function<void(inertial_motion_t)>;

  SimulatedInertial(const Options& options, std::uint64_t seed, SensorPose sensor, Loop& loop,
                    Publish publish);
  ~SimulatedInertial();

 private:
  void measure();
  Velocity true_velocity(Utime t) const;

  Options options_;
  Random random_;
  SensorPose sensor_;
  Loop& loop_;
  Publish publish_;
  Vector3d acceleration_bias_;
  Vector3d turn_rate_bias_;
  std::optional<Utime> last_;  // measured, and the velocity then
  Velocity last_velocity_;
  std::int64_t seq_ = 0;
  Loop::TimerId timer_;
};

}  // namespace berth
