// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/bus/loop.h"
#include "common/core/arm_kinematics.h"
#include "drivers/arm/adapter.h"

namespace berth {

/// Following error of an arm's servos: how far the joints are behind the positions that the
/// controller commands. Under proportional position control the error e of a joint commanded at the
/// speed v obeys T de/dt = v T - e, T the loop's time constant (the reciprocal of its gain). At a
/// steady speed e is v T, and after a stop it dies away with T.
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

/// m between the flange as the controller reports it and as the kinematics put it; nothing where
/// the controller reports none.
std::optional<double> flange_difference(const ArmReport& report, const ArmKinematics& kinematics);

/// Empty, or how reported and computed flange differ by more than rounding.
std::string foreign_kinematics(const ArmReport& report, const ArmKinematics& kinematics);

}  // namespace berth
