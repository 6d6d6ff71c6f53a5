// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/trajectories/trajectory.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

namespace {

using std::numbers::pi;

Pose shifted(Pose pose, const Vector3d& by) {
  pose.position += by;
  return pose;
}

}  // namespace

Waypoints straight(const Pose& from, const Straight& options) {
  const Vector3d turn = rotation_vector(options.by.rotation);
  const Vector3d& by = options.by.position;
  // In seconds at full speed, so that translation and rotation both keep their limits.
  const double length = std::max(by.norm() / options.speed, turn.norm() / options.angular_speed);
  const SmoothTravel travel = eased(length, 1, options.ramp);
  return sampled(
      [&](double t) {
        const double s = travel.position(t) / length;
        Vector6d step;
        step << s * by, s * turn;
        return perturbed(from, step);
      },
      travel.duration());
}

Waypoints bar_approach(const Pose& from, const BarApproach& options) {
  struct Leg {
    double begin;  // s
    double from;   // m along z
    double to;
    SmoothTravel travel;
  };
  std::vector<double> stops = options.holds;
  stops.push_back(options.to);
  std::vector<Leg> legs;
  double time = 0;
  double z = from.position.z();
  for (const double stop : stops) {
    const SmoothTravel travel = eased(std::abs(stop - z), options.speed, options.ramp);
    legs.push_back({time, z, stop, travel});
    time += travel.duration() + options.hold_for;
    z = stop;
  }
  const auto at = [&](double t) {
    auto leg = legs.begin();
    while (leg + 1 != legs.end() && (leg + 1)->begin <= t) ++leg;
    const double length = leg->travel.length();
    const double s = length > 0 ? leg->travel.position(t - leg->begin) / length : 1.0;
    const double out = std::sin(pi * s);
    Pose pose = shifted(from, options.bulge * out * out * options.bulge_along);
    pose.position.z() += leg->from + s * (leg->to - leg->from) - from.position.z();
    return pose;
  };
  return sampled(at, time - options.hold_for);
}

Waypoints oscillation(const Pose& from, const Oscillation& options) {
  const Vector3d axis = options.axis.normalized();
  const SmoothTravel phase =
      eased(2 * pi * options.cycles, options.speed / options.amplitude, options.ramp);
  return sampled(
      [&](double t) {
        return shifted(from, options.amplitude * std::sin(phase.position(t)) * axis);
      },
      phase.duration());
}

Waypoints spiral(const Pose& from, const Spiral& options) {
  // r = a * angle; its length is a / 2 (u sqrt(1 + u^2) + asinh u) at the angle u.
  const double last = 2 * pi * options.turns;
  const double a = options.radius / last;
  const auto length = [a](double u) {
    return 0.5 * a * (u * std::sqrt(1 + u * u) + std::asinh(u));
  };
  const SmoothTravel travel = eased(length(last), options.speed, options.ramp);
  double u = 0;
  return sampled(
      [&](double t) {
        const double s = travel.position(t);
        for (int i = 0; i < 20; ++i) {
          const double step = (s - length(u)) / (a * std::sqrt(1 + u * u));
          u += step;
          if (std::abs(step) < 1e-12) break;
        }
        return shifted(from, a * u * Vector3d(std::cos(u), std::sin(u), 0));
      },
      travel.duration());
}

Waypoints drift(const Pose& from, const Drift& options) {
  // Ratios of the periods: no two have a small common multiple.
  constexpr double ratios[6] = {1, 1.31, 1.73, 2.11, 1.53, 1.19};
  const SmoothTravel time = eased_time(options.duration, options.ramp);
  return sampled(
      [&](double t) {
        Vector6d step;
        for (int i = 0; i < 6; ++i) {
          const double phase = 2 * pi * time.position(t) / (options.period * ratios[i]);
          step[i] = (i < 3 ? options.amplitude : options.turn) * std::sin(phase);
        }
        return perturbed(from, step);
      },
      time.duration());
}

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
  constexpr double max_step = 0.01;  // s
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(dt) / max_step)));
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
