// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/cell.h"

namespace berth {

/// Cell::relative_pose for one who asks again and again: worked out anew only when a joint has
/// moved, for arms stand still most of the time. For one thread.
class RelativePose {
 public:
  /// The cell must outlive it.
  explicit RelativePose(const Cell& cell) : cell_(cell) {}

  const Pose& at(const Joints& replica, const Joints& sensor) {
    if (known_ && replica == replica_ && sensor == sensor_) return pose_;
    known_ = true;
    replica_ = replica;
    sensor_ = sensor;
    return pose_ = cell_.relative_pose(replica, sensor);
  }

 private:
  const Cell& cell_;
  bool known_ = false;
  Joints replica_{};
  Joints sensor_{};
  Pose pose_;
};

}  // namespace berth
