// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <vector>

#include "common/bus/loop.h"

namespace berth {

/// A device's clock as a line over the host's, fixed at one moment.
struct ClockLine {
  Utime host = 0;           ///< host time at which offset holds, us
  std::int64_t offset = 0;  ///< device clock minus host clock, us
  double drift = 0;         ///< rate of the offset, s/s
  double sigma_s = 0;       ///< standard deviation of the offset, s

  /// Host time of a device time, both us.
  Utime to_host(std::int64_t device) const;
};

/// Offset and drift of a device's clock against the host's, by linear programming on brackets
/// (Zhang, Liu, Xia: Clock synchronization algorithms for network measurements, INFOCOM 2002).
/// The host reads the device's clock d between sending (s) and receiving (r); a clock that is
/// renewed every q shows d while its true time lies in [d, d + q]. The offset at that moment is
/// therefore within [d - r, d + q - s], but for 1 us on either side. Of all lines offset + drift (t
/// - t0) that pass through every bracket of the last 20 s the map takes the middle of those at the
/// last reading. History that no line explains (the drift changed) is dropped, oldest first.
class ClockMap {
 public:
  /// resolution: q, us.
  explicit ClockMap(Utime resolution = 0) : resolution_(resolution) {}

  /// One reading: host times of sending and receiving, and the device's reading, all us.
  /// @return false when no line passes through this bracket and the one before: the clock was set;
  /// only this reading is kept.
  bool add(Utime sent, std::int64_t device, Utime received);
  void clear() { histories_.clear(); }

  bool valid() const { return !histories_.empty(); }
  /// As of the last reading. @pre valid()
  const ClockLine& line() const { return line_; }

 private:
  /// The lines through all brackets since `start`: a convex polygon of (offset, drift).
  struct History {
    struct Line {
      double offset;  ///< at start, us
      double drift;
    };
    Utime start;
    std::int64_t base;  ///< added to offset, us: keeps numbers small
    std::vector<Line> lines;

    void clip(Utime host, std::int64_t low, std::int64_t high);
  };
  static History begin(Utime host, std::int64_t low, std::int64_t high);
  void estimate(Utime host);

  Utime resolution_;
  std::deque<History> histories_;  // each begins some seconds after the one before
  ClockLine line_;
};

}  // namespace berth
