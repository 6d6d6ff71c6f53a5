// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/clock_map.h"

#include <algorithm>
#include <cmath>

namespace berth::lidar {
namespace {

constexpr std::size_t remembered = 32;
constexpr double drift = 100e-6;  // two quartz clocks, each good to 50 ppm

}  // namespace

void ClockMap::add(Utime sent, std::int64_t device, Utime received) {
  exchanges_.push_back({sent, device, received});
  if (exchanges_.size() > remembered) exchanges_.pop_front();
}

double ClockMap::half_width(const Exchange& exchange) const {
  const double age = static_cast<double>(exchanges_.back().received - exchange.received);
  return 0.5 * static_cast<double>(exchange.received - exchange.sent) + drift * age;
}

const ClockMap::Exchange& ClockMap::best() const {
  return *std::min_element(
      exchanges_.begin(), exchanges_.end(),
      [this](const Exchange& a, const Exchange& b) { return half_width(a) < half_width(b); });
}

std::int64_t ClockMap::offset() const {
  const Exchange& exchange = best();
  return exchange.device - (exchange.sent + (exchange.received - exchange.sent) / 2);
}

double ClockMap::sigma_s() const { return half_width(best()) * 1e-6 / std::sqrt(3.0); }

}  // namespace berth::lidar
