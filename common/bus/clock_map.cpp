// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/clock_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace berth {
namespace {

/// Two quartz clocks of 50 ppm each, and a host whose time service slews it: Linux allows 500 ppm.
constexpr double max_drift = 600e-6;
/// Ten histories, each begun so much after the one before: 20 s, in which a quartz at room
/// temperature changes its rate by far less than a bracket can resolve.
constexpr Utime spacing = 2 * second;
constexpr std::size_t kept = 10;

}  // namespace

Utime ClockLine::to_host(std::int64_t device) const {
  const Utime near = device - offset;
  return near - std::llround(drift * static_cast<double>(near - host));
}

ClockMap::History ClockMap::begin(Utime host, std::int64_t low, std::int64_t high) {
  const auto width = static_cast<double>(high - low);
  return {host, low, {{0, -max_drift}, {width, -max_drift}, {width, max_drift}, {0, max_drift}}};
}

void ClockMap::History::clip(Utime host, std::int64_t low, std::int64_t high) {
  const auto age = static_cast<double>(host - start);
  // Sutherland and Hodgman: keeps the part of the polygon where sign * offset(host) <= limit.
  const auto keep = [&](double sign, double limit) {
    std::vector<Line> left;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const Line& a = lines[i];
      const Line& b = lines[(i + 1) % lines.size()];
      const double beyond_a = sign * (a.offset + a.drift * age) - limit;
      const double beyond_b = sign * (b.offset + b.drift * age) - limit;
      if (beyond_a <= 0) left.push_back(a);
      if ((beyond_a < 0 && beyond_b > 0) || (beyond_a > 0 && beyond_b < 0)) {
        const double part = beyond_a / (beyond_a - beyond_b);
        left.push_back(
            {a.offset + part * (b.offset - a.offset), a.drift + part * (b.drift - a.drift)});
      }
    }
    lines = std::move(left);
  };
  keep(1, static_cast<double>(high - base));
  keep(-1, -static_cast<double>(low - base));
}

bool ClockMap::add(Utime sent, std::int64_t device, Utime received) {
  const Utime host = sent + (received - sent) / 2;
  // Stamps are truncated to whole microseconds.
  const std::int64_t low = device - received - 1;
  const std::int64_t high = device + resolution_ - sent + 1;

  const bool known = valid();
  for (History& history : histories_) history.clip(host, low, high);
  while (!histories_.empty() && histories_.front().lines.empty()) histories_.pop_front();
  const bool steady = !known || valid();
  if (!valid() || host - histories_.back().start >= spacing) {
    histories_.push_back(begin(host, low, high));
    if (histories_.size() > kept) histories_.pop_front();
  }
  estimate(host);
  return steady;
}

void ClockMap::estimate(Utime host) {
  const History& history = histories_.front();
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double min_drift_seen = low;
  double max_drift_seen = high;
  for (const History::Line& line : history.lines) {
    const double offset = line.offset + line.drift * static_cast<double>(host - history.start);
    low = std::min(low, offset);
    high = std::max(high, offset);
    min_drift_seen = std::min(min_drift_seen, line.drift);
    max_drift_seen = std::max(max_drift_seen, line.drift);
  }
  line_.host = host;
  line_.offset = history.base + std::llround(0.5 * (low + high));
  line_.drift = 0.5 * (min_drift_seen + max_drift_seen);
  line_.sigma_s = 1e-6 * (high - low) / std::sqrt(12.0);  // of a uniform distribution
}

}  // namespace berth
