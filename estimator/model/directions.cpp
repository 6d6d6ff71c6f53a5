// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/directions.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

std::vector<Vector3d> spread_directions(int count) {
  const double golden_angle = radians(180.0) * (3.0 - std::sqrt(5.0));
  std::vector<Vector3d> result;
  result.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double radius = std::sqrt(1.0 - z * z);
    result.emplace_back(radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i),
                        z);
  }
  return result;
}

const std::array<Vector3d, direction_count>& view_directions() {
  static const std::array<Vector3d, direction_count> directions = [] {
    std::array<Vector3d, direction_count> result;
    const std::vector<Vector3d> spread = spread_directions(direction_count);
    std::copy(spread.begin(), spread.end(), result.begin());
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
