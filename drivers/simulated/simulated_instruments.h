// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/inertial_motion_t.hpp>
#include <fstream>
#include <functional>
#include <optional>

#include "common/bus/loop.h"
#include "common/core/pose.h"
#include "common/core/random.h"
#include "common/core/reflectors.h"

namespace berth {

/// The chaser's inertial unit, next to the sensor: it measures the sensor's own motion, with
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

/// A laser tracker that looks at one reflector after the other and writes what it sees into a CSV
/// file, as an operator's instrument would: time (s), point, x, y, z (mm) in the tracker's own
/// frame. Its line of sight is never occluded.
class SimulatedTracker {
 public:
  struct Options {
    bool write = false;
    Utime period = 50 * millisecond;  ///< from one reflector to the next
    Pose place;                       ///< T_cell_tracker
  };
  /// T_cell_sensor or T_cell_model, truly, at a time up to now.
  using ToolPose = std::function<Pose(ArmRole, Utime)>;

  /// @throws InputError when the file cannot be written.
  SimulatedTracker(const TrackerSetup& setup, const Options& options, std::uint64_t seed,
                   ToolPose tool, Loop& loop, const std::filesystem::path& file);
  ~SimulatedTracker();

 private:
  void measure();

  TrackerSetup setup_;
  Pose to_tracker_;
  Random random_;
  ToolPose tool_;
  Loop& loop_;
  std::ofstream file_;
  std::size_t next_ = 0;
  Loop::TimerId timer_;
};

}  // namespace berth
