// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/trajectories/trajectory.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {

Waypoints sampled(const Motion& motion, double duration) {
  if (!(duration > 0)) return {{0, motion(0)}};
  constexpr double finest = 0.05;  // s
  const auto intervals = std::clamp(static_cast<std::size_t>(std::ceil(duration / finest)),
                                    std::size_t{4}, max_waypoints - 1);
  Waypoints waypoints;
  waypoints.reserve(intervals + 1);
  for (std::size_t i = 0; i <= intervals; ++i) {
    const double t = duration * static_cast<double>(i) / static_cast<double>(intervals);
    waypoints.push_back({t, motion(t)});
  }
  return waypoints;
}

SmoothTravel eased(double length, double speed, double ramp) {
  return {length, speed, 1.5 * speed / ramp, 6 * speed / (ramp * ramp)};
}

}  // namespace berth::testbed
