// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/clohessy_wiltshire.h"

#include <cmath>

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

}  // namespace berth::testbed
