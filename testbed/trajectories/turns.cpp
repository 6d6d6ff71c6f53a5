// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/trajectories/turns.h"

#include <cmath>

namespace berth::testbed {

Waypoints fly_around(const Pose& from, const FlyAround& options) {
  const Vector3d axis = std::copysign(1.0, options.angle) * options.axis.normalized();
  const SmoothTravel travel = eased(std::abs(options.angle), options.speed, options.ramp);
  return sampled(
      [&](double t) {
        return Pose{from.position, rotation_from_vector(travel.position(t) * axis) * from.rotation};
      },
      travel.duration());
}

void TorqueFreeBody::step(double dt) {
  struct Rates {
    Eigen::Vector4d attitude;
    Vector3d rate;
  };
  const auto rates_at = [this](const Quaterniond& q, const Vector3d& w) {
    const Quaterniond turn = q * Quaterniond(0, w.x(), w.y(), w.z());
    const Vector3d torque = -w.cross(inertia_.cwiseProduct(w));
    return Rates{0.5 * turn.coeffs(), torque.cwiseQuotient(inertia_)};
  };
  const auto at = [&](const Rates& rates, double h) {
    return rates_at(Quaterniond(attitude_.coeffs() + h * rates.attitude), rate_ + h * rates.rate);
  };
  const Rates a = rates_at(attitude_, rate_);
  const Rates b = at(a, dt / 2);
  const Rates c = at(b, dt / 2);
  const Rates d = at(c, dt);
  attitude_.coeffs() += dt / 6 * (a.attitude + 2 * b.attitude + 2 * c.attitude + d.attitude);
  attitude_.normalize();
  rate_ += dt / 6 * (a.rate + 2 * b.rate + 2 * c.rate + d.rate);
}

void TorqueFreeBody::advance(double dt) {
  constexpr double longest = 0.01;  // s
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(dt) / longest)));
  for (int i = 0; i < steps; ++i) step(dt / steps);
}

Waypoints tumble(const Pose& from, const Tumble& options) {
  TorqueFreeBody body(from.rotation, options.inertia, options.rate);
  const SmoothTravel time = eased_time(options.duration, options.ramp);
  double reached = 0;
  return sampled(
      [&](double t) {
        body.advance(time.position(t) - reached);
        reached = time.position(t);
        return Pose{from.position, body.attitude()};
      },
      time.duration());
}

}  // namespace berth::testbed
