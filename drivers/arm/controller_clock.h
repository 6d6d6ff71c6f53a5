// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/bus/loop.h"

namespace berth {

/// A controller's tick, unwrapped.
class ControllerClock {
 public:
  explicit ControllerClock(int wrap) : wrap_(wrap) {}

  /// tick_ms: as it stands in the registers. @return us, of the controller's clock
  Utime add(int tick_ms) {
    const int step = ((tick_ms - tick_ms_) % wrap_ + wrap_) % wrap_;
    time_ = known_ ? time_ + step * millisecond : tick_ms * millisecond;
    tick_ms_ = tick_ms;
    known_ = true;
    return time_;
  }
  void clear() { known_ = false; }

 private:
  int wrap_;
  bool known_ = false;
  int tick_ms_ = 0;
  Utime time_ = 0;
};

}  // namespace berth
