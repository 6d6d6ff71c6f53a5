// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/filter/target_tracker.h"

#include <algorithm>

namespace berth::estimator {

Motion perturbed(const Motion& motion, const Vector12d& d) {
  Motion result = motion;
  result.pose = berth::perturbed(motion.pose, d.head<6>());
  result.velocity.linear += d.segment<3>(6);
  result.velocity.angular += d.tail<3>();
  return result;
}

Vector12d difference(const Motion& from, const Motion& to) {
  Vector12d d;
  d << berth::difference(from.pose, to.pose), to.velocity.linear - from.velocity.linear,
      to.velocity.angular - from.velocity.angular;
  return d;
}

void SensorMotions::add(const SensorMotion& motion) {
  if (motion.begin >= motion.end) return;
  if (!motions_.empty() && motion.begin < motions_.back().end) return;
  constexpr std::size_t max_motions = 100000;  // bounds the memory while no scans come
  if (motions_.size() == max_motions) motions_.pop_front();
  motions_.push_back(motion);
}

double SensorMotions::propagate(TargetTracker& tracker, std::int64_t until) const {
  double known = 0;
  for (const SensorMotion& motion : motions_) {
    const std::int64_t from = std::max(tracker.utime(), motion.begin);
    const std::int64_t to = std::min(until, motion.end);
    if (from >= to) continue;
    tracker.propagate(motion, until);
    known += elapsed(from, to);
  }
  return known;
}

void SensorMotions::forget_before(std::int64_t utime) {
  while (!motions_.empty() && motions_.front().end <= utime) motions_.pop_front();
}

}  // namespace berth::estimator
