// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>

#include "common/bus/loop.h"

namespace berth::lidar {

/// What the host knows of a device's clock. Each exchange brackets it: the device read its clock
/// somewhere between the host's sending and receiving. The tightest of the recent brackets is used;
/// a bracket widens with age by what two quartz clocks may drift apart.
class ClockMap {
 public:
  /// Host times of sending and receiving, and the device's own in between, us.
  void add(Utime sent, std::int64_t device, Utime received);
  void clear() { exchanges_.clear(); }

  bool valid() const { return !exchanges_.empty(); }
  /// Device clock minus host clock, us. @pre valid()
  std::int64_t offset() const;
  /// 1 sigma of the offset, s. @pre valid()
  double sigma_s() const;
  /// @pre valid()
  Utime to_host(std::int64_t device) const { return device - offset(); }

 private:
  struct Exchange {
    Utime sent;
    std::int64_t device;
    Utime received;
  };
  double half_width(const Exchange& exchange) const;
  const Exchange& best() const;

  std::deque<Exchange> exchanges_;
};

}  // namespace berth::lidar
