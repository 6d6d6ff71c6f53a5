// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/retreat.h"

#include <algorithm>
#include <limits>
#include <numbers>

namespace berth::testbed {
namespace {

constexpr double orbits = 2;
constexpr int orbit_samples = 720;
constexpr double speeds[] = {1, 1.5, 2, 3, 5};

/// Least distance in the free drift over that at the burn's end; below 1: it comes nearer.
double nearest_share(const HillState& burnt, double n) {
  const double start = burnt.position.norm();
  const double horizon = orbits * 2 * std::numbers::pi / n;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 1; i <= orbit_samples; ++i) {
    // close together at first, where it is near
    const double s = static_cast<double>(i) / orbit_samples;
    const HillState later = propagated(burnt, Vector3d::Zero(), n, horizon * s * s);
    least = std::min(least, later.position.norm());
  }
  return least / start;
}

}  // namespace

Vector3d passively_safe_burn(const HillState& state, double n, double min_speed,
                             double greatest_acceleration) {
  const Vector3d out = state.position.normalized();
  Vector3d best = min_speed * out - state.velocity;
  double best_burn = std::numeric_limits<double>::infinity();
  double best_share = 0;
  for (int k = 0; k < 27; ++k) {
    const Vector3d corner = Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1).cast<double>();
    if (corner.norm() == 0) continue;
    const Vector3d direction = corner.normalized();
    if (direction.dot(out) < 0.4) continue;
    for (const double factor : speeds) {
      const Vector3d velocity = factor * min_speed / direction.dot(out) * direction;
      const Vector3d burn = velocity - state.velocity;
      const double time = burn.lpNorm<Eigen::Infinity>() / greatest_acceleration;
      const HillState burnt = propagated(state, burn / std::max(time, 1e-6), n, time);
      const double share = nearest_share(burnt, n);
      const bool safe = share >= 1;
      const bool best_safe = best_share >= 1;
      if (safe ? (!best_safe || burn.norm() < best_burn) : (!best_safe && share > best_share)) {
        best = burn;
        best_burn = burn.norm();
        best_share = share;
      }
    }
  }
  return best;
}

}  // namespace berth::testbed
