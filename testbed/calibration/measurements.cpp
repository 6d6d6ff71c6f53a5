// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/measurements.h"

#include <algorithm>

namespace berth::testbed {

void JointTrack::add(double t, const Joints& joints) {
  if (!times_.empty() && t <= times_.back()) return;
  times_.push_back(t);
  joints_.push_back(joints);
}

std::optional<JointTrack::State> JointTrack::at(double t) const {
  constexpr double max_gap = 0.1;
  const auto after = std::upper_bound(times_.begin(), times_.end(), t);
  if (after == times_.begin() || after == times_.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - times_.begin());
  const double gap = times_[i] - times_[i - 1];
  if (gap > max_gap) return std::nullopt;
  const double s = (t - times_[i - 1]) / gap;
  State state;
  for (std::size_t k = 0; k < 6; ++k) {
    const double change = joints_[i][k] - joints_[i - 1][k];
    state.joints[k] = joints_[i - 1][k] + s * change;
    state.rates[k] = change / gap;
  }
  return state;
}

}  // namespace berth::testbed
