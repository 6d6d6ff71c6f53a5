// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/position_register_loop.h"

#include <algorithm>
#include <cmath>

namespace berth {

double PositionRegisterLoop::Motion::share(Utime t) const {
  const double s = std::clamp(seconds(t - begin), 0.0, total);
  const double rate = 1 / (total - ramp);  // between the ramps
  if (s < ramp) return 0.5 * rate * s * s / ramp;
  if (s <= total - ramp) return rate * (s - 0.5 * ramp);
  const double left = total - s;
  return 1 - 0.5 * rate * left * left / ramp;
}

void PositionRegisterLoop::start(const Motors& here, Utime now) {
  writes_.assign(1, {now, here});
  read_ = rest_ = target_ = here;
  motions_.clear();
}

void PositionRegisterLoop::advance(Utime now, const Limits& limits) {
  while (!writes_.empty() && writes_.front().visible <= now) {
    read_ = writes_.front().target;
    writes_.pop_front();
  }
  while (!motions_.empty() && motions_.front().over(now)) {
    rest_ += motions_.front().way;
    motions_.pop_front();
  }
  if (motions_.size() > 1 || read_ == target_) return;
  if (!motions_.empty()) {
    const Motion& last = motions_.back();
    if (seconds(now - last.begin) < last.total - last.ramp * cnt_ / 100) return;
  }
  Motion next;
  next.begin = now;
  next.way = read_ - target_;
  double rate = INFINITY;
  double growth = INFINITY;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double way = std::abs(next.way[i]);
    if (way == 0) continue;
    rate = std::min(rate, limits.speed[i] / way);
    growth = std::min(growth, limits.acceleration[i] / way);
  }
  if (rate == 0) return;
  next.ramp = std::min(rate / growth, std::sqrt(1 / growth));
  next.total = std::max(1 / rate, next.ramp) + next.ramp;
  target_ = read_;
  motions_.push_back(next);
}

PositionRegisterLoop::Motors PositionRegisterLoop::position(Utime t) const {
  Motors at = rest_;
  for (const Motion& motion : motions_) at += motion.share(t) * motion.way;
  return at;
}

}  // namespace berth
