// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/arm_motion.h"

#include <algorithm>

namespace berth::testbed {

RecordedMotion::RecordedMotion(std::vector<ArmPair> points, const std::vector<double>& lengths,
                               double speed, double acceleration, double jerk)
    : points_(std::move(points)), position_{0} {
  for (const double length : lengths) position_.push_back(position_.back() + length);
  travel_ = SmoothTravel(position_.back(), speed, acceleration, jerk);
}

std::optional<ArmPair> RecordedMotion::at(double t, const ArmPair&, std::string*) const {
  if (points_.size() == 1) return points_.front();
  const double position = travel_.position(t);
  const auto next = std::upper_bound(position_.begin() + 1, position_.end() - 1, position);
  const auto i = static_cast<std::size_t>(next - position_.begin());
  const double span = position_[i] - position_[i - 1];
  const double s = span > 0 ? (position - position_[i - 1]) / span : 1.0;
  return blend(points_[i - 1], points_[i], std::clamp(s, 0.0, 1.0));
}

}  // namespace berth::testbed
