// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/following_error.h"

#include <cmath>

namespace berth {

void FollowingError::add(Utime time, const Joints& joints) {
  const double dt = seconds(time - time_);
  if (!known_) error_.fill(0);
  if (known_ && lag_ > 0 && dt > 0) {
    const double remains = std::exp(-dt / lag_);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const double speed = (joints[i] - joints_[i]) / dt;
      error_[i] = remains * error_[i] + (1 - remains) * speed * lag_;
    }
  }
  known_ = true;
  time_ = time;
  joints_ = joints;
}

}  // namespace berth
