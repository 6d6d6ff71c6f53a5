// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "common/bus/loop.h"

namespace berth {

/// Relates a controller's clock to the host's. The controller shows the start of its current
/// period; the host knows only that this was read between sending and receiving. Each read so
/// bounds the offset from both sides; the bounds of the last seconds are intersected.
class ControllerClock {
 public:
  /// tick_period: how often the controller renews its tick; wrap: count (ms) at which it starts
  /// anew.
  ControllerClock(Utime tick_period, int wrap_ms) : period_(tick_period), wrap_ms_(wrap_ms) {}

  /// A tick (ms) read within the bracket. @return the controller's time, unwrapped, us.
  Utime add(int tick_ms, Utime sent, Utime received);
  bool known() const { return readings_ > 0; }
  /// Controller clock minus host clock, s.
  double offset_s() const;
  /// Half-width of the bounds as a uniform distribution's standard deviation, s.
  double offset_sigma_s() const;
  /// Host time of a controller time.
  Utime host_time(Utime controller_time) const;
  /// After a reconnection or a reboot of the controller.
  void reset();

 private:
  struct Bounds {
    Utime low = std::numeric_limits<Utime>::min();
    Utime high = std::numeric_limits<Utime>::max();
    void intersect(const Bounds& other);
  };
  Bounds bounds() const;

  static constexpr Utime window = 2 * second;  // drift of 50 ppm within it: 0.1 ms

  Utime period_;
  int wrap_ms_;
  int readings_ = 0;
  int last_tick_ms_ = 0;
  Utime unwrapped_ = 0;
  Utime window_start_ = 0;
  Bounds current_;
  Bounds previous_;
};

}  // namespace berth
