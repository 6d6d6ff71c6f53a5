// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/controller_clock.h"

#include <algorithm>
#include <cmath>

namespace berth {

void ControllerClock::Bounds::intersect(const Bounds& other) {
  low = std::max(low, other.low);
  high = std::min(high, other.high);
}

Utime ControllerClock::add(int tick_ms, Utime sent, Utime received) {
  if (readings_ == 0) {
    unwrapped_ = static_cast<Utime>(tick_ms) * millisecond;
    window_start_ = received;
  } else {
    int step = (tick_ms - last_tick_ms_) % wrap_ms_;
    if (step < 0) step += wrap_ms_;
    unwrapped_ += static_cast<Utime>(step) * millisecond;
  }
  last_tick_ms_ = tick_ms;
  ++readings_;

  if (received - window_start_ > window) {
    previous_ = current_;
    current_ = {};
    window_start_ = received;
  }
  const Bounds here{unwrapped_ - received, unwrapped_ + period_ - sent};
  current_.intersect(here);
  if (current_.low > current_.high) {  // the controller's clock was set
    current_ = here;
    previous_ = {};
  }
  return unwrapped_;
}

ControllerClock::Bounds ControllerClock::bounds() const {
  Bounds both = current_;
  both.intersect(previous_);
  return both.low <= both.high ? both : current_;
}

double ControllerClock::offset_s() const {
  const Bounds b = bounds();
  return 0.5 * seconds(b.low + b.high);
}

double ControllerClock::offset_sigma_s() const {
  const Bounds b = bounds();
  return seconds(b.high - b.low) / std::sqrt(12.0);
}

Utime ControllerClock::host_time(Utime controller_time) const {
  const Bounds b = bounds();
  return controller_time - (b.low + (b.high - b.low) / 2);
}

void ControllerClock::reset() {
  readings_ = 0;
  current_ = previous_ = {};
}

}  // namespace berth
