// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/inertial_motion_t.hpp>
#include <cstdint>
#include <optional>

#include "common/core/pose.h"

namespace berth::testbed {

/// The chaser's own motion, as an inertial unit would measure it: the changes of velocity that
/// guidance commands. Relative to the frame in which the target rests if it does not move by
/// itself, whichever arm carries the motion out.
class ChaserMotion {
 public:
  /// One set-point after the other.
  /// @param utime us, at which it is carried out
  /// @param commanded T_sensor_model, had the target not moved by itself
  /// @return periodically: the interval since the last one, without seq and session. After a gap it
  /// begins anew.
  std::optional<inertial_motion_t> add(std::int64_t utime, const Pose& commanded);

 private:
  struct Moving {
    std::int64_t utime = 0;
    Velocity velocity;  // linear: outer frame; angular: the sensor's axes
  };
  std::int64_t utime_ = 0;
  std::optional<Pose> sensor_;
  std::optional<Moving> reported_;  // up to here
};

}  // namespace berth::testbed
