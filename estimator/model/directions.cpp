// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/directions.h"

#include <cmath>

namespace berth::estimator {

const std::array<Vector3d, direction_count>& view_directions() {
  static const std::array<Vector3d, direction_count> directions = [] {
    std::array<Vector3d, direction_count> result;
    const double golden_angle = radians(180.0) * (3.0 - std::sqrt(5.0));
    for (int i = 0; i < direction_count; ++i) {
      const double z = 1.0 - (2.0 * i + 1.0) / direction_count;
      const double radius = std::sqrt(1.0 - z * z);
      result[static_cast<std::size_t>(i)] = {radius * std::cos(golden_angle * i),
                                             radius * std::sin(golden_angle * i), z};
    }
    return result;
  }();
  return directions;
}

int nearest_direction(const Vector3d& direction) {
  const auto& directions = view_directions();
  int best = 0;
  double best_dot = -1e300;
  for (int i = 0; i < direction_count; ++i) {
    const double dot = directions[static_cast<std::size_t>(i)].dot(direction);
    if (dot > best_dot) {
      best_dot = dot;
      best = i;
    }
  }
  return best;
}

}  // namespace berth::estimator
