// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/bus/loop.h"
#include "common/core/arm_kinematics.h"

namespace berth {

/// By how much an arm's joints are behind the positions that its controller hands to the servos: of
/// a servo with a proportional position loop, the error e of a joint that is told to go at v
/// follows T de/dt = v T - e, T the loop's time constant (the reciprocal of its gain). At a steady
/// speed e is v T, and after a stop it dies away with T.
class FollowingError {
 public:
  /// lag: T, s; 0: positions are measured, and there is no such error.
  explicit FollowingError(double lag) : lag_(lag) {}

  /// The positions of a time of the controller's clock (us), in order. After clear() as at rest.
  void add(Utime time, const Joints& joints);
  void clear() { known_ = false; }

  /// rad, m
  const Joints& joints() const { return error_; }

 private:
  double lag_;
  bool known_ = false;
  Utime time_ = 0;
  Joints joints_{};
  Joints error_{};
};

}  // namespace berth
