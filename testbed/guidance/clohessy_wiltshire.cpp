// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/clohessy_wiltshire.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace berth::testbed {

double mean_motion(double altitude) {
  constexpr double earth_mu = 3.986004418e14;  // m^3/s^2, WGS 84
  constexpr double earth_radius = 6378137.0;   // m, WGS 84
  const double radius = earth_radius + altitude;
  return std::sqrt(earth_mu / (radius * radius * radius));
}

Vector3d relative_gravity(const HillState& state, double n) {
  return {3 * n * n * state.position.x() + 2 * n * state.velocity.y(), -2 * n * state.velocity.x(),
          -n * n * state.position.z()};
}

HillState propagated(const HillState& state, const Vector3d& a, double n, double dt) {
  const Vector3d& r = state.position;
  const Vector3d& v = state.velocity;
  const double t = n * dt;
  const double s = std::sin(t);
  const double c = std::cos(t);
  const double half = std::sin(0.5 * t);
  const double d = 2 * half * half;  // 1 - c, without loss of digits
  HillState next;
  next.position.x() = (4 - 3 * c) * r.x() + s / n * v.x() + 2 * d / n * v.y() +
                      d / (n * n) * a.x() + 2 * (t - s) / (n * n) * a.y();
  next.position.y() = 6 * (s - t) * r.x() + r.y() - 2 * d / n * v.x() +
                      (4 * s - 3 * t) / n * v.y() - 2 * (t - s) / (n * n) * a.x() +
                      (4 * d / (n * n) - 1.5 * dt * dt) * a.y();
  next.position.z() = c * r.z() + s / n * v.z() + d / (n * n) * a.z();
  next.velocity.x() =
      3 * n * s * r.x() + c * v.x() + 2 * s * v.y() + s / n * a.x() + 2 * d / n * a.y();
  next.velocity.y() = -6 * n * d * r.x() - 2 * s * v.x() + (4 * c - 3) * v.y() - 2 * d / n * a.x() +
                      (4 * s / n - 3 * dt) * a.y();
  next.velocity.z() = -n * s * r.z() + c * v.z() + s / n * a.z();
  return next;
}

namespace {

constexpr double orbits = 2;
constexpr int orbit_samples = 720;
constexpr double speeds[] = {1, 1.5, 2, 3, 5};

/// Least distance in the free drift over that at the burn's end; below 1: it comes nearer.
double nearest_share(const HillState& burnt, double n) {
  const double start = burnt.position.norm();
  const double horizon = orbits * 2 * std::numbers::pi / n;
  double min_distance = std::numeric_limits<double>::infinity();
  for (int i = 1; i <= orbit_samples; ++i) {
    // close together at first, where it is near
    const double s = static_cast<double>(i) / orbit_samples;
    const HillState later = propagated(burnt, Vector3d::Zero(), n, horizon * s * s);
    min_distance = std::min(min_distance, later.position.norm());
  }
  return min_distance / start;
}

}  // namespace

Vector3d passively_safe_burn(const HillState& state, double n, double min_speed,
                             double max_acceleration) {
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
      const double time = burn.lpNorm<Eigen::Infinity>() / max_acceleration;
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
