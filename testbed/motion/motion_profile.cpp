// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/motion_profile.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {
namespace {

/// Time of a cubic rise to the speed: 1.5 speed / ramp and 6 speed / ramp^2 are its extremes.
double ramp_time(double speed, double acceleration, double jerk) {
  return std::max(1.5 * speed / acceleration, std::sqrt(6 * speed / jerk));
}

}  // namespace

SmoothTravel::SmoothTravel(double length, double speed, double acceleration, double jerk)
    : length_(length), peak_(speed) {
  if (length <= 0) return;
  ramp_ = ramp_time(speed, acceleration, jerk);
  if (speed * ramp_ > length) {
    // too short for full speed: both limits solved for length = peak * ramp(peak)
    peak_ = std::min(std::sqrt(length * acceleration / 1.5), std::cbrt(length * length * jerk / 6));
    ramp_ = length / peak_;
  }
  cruise_ = std::max(0.0, length / peak_ - ramp_);
}

double SmoothTravel::rise(double t) const {
  const double x = t / ramp_;
  return peak_ * ramp_ * x * x * x * (1 - 0.5 * x);
}

double SmoothTravel::position(double t) const {
  if (t <= 0 || length_ <= 0) return 0;
  if (t >= duration()) return length_;
  if (t < ramp_) return rise(t);
  if (t > ramp_ + cruise_) return length_ - rise(duration() - t);
  return peak_ * (0.5 * ramp_ + (t - ramp_));
}

double SmoothTravel::speed(double t) const {
  if (t <= 0 || t >= duration() || length_ <= 0) return 0;
  const double x = std::min({t, duration() - t, ramp_}) / ramp_;
  return peak_ * x * x * (3 - 2 * x);
}

double TimeScale::frequency(double settling) { return 9.2 / settling; }

TimeScale::TimeScale(double settling) : frequency_(frequency(settling)) {}

void TimeScale::stop() { target_ = rate_ = slope_ = 0; }

double TimeScale::advance(double dt) {
  // a critically damped second-order system, in closed form over the step
  const double error = rate_ - target_;
  const double slope = slope_;
  const double w = frequency_;
  const double decay = std::exp(-w * dt);
  const double c = slope + w * error;
  const double before = rate_;
  rate_ = target_ + (error + c * dt) * decay;
  slope_ = (slope - w * c * dt) * decay;
  if (std::abs(rate_ - target_) < 1e-3 && std::abs(slope_) < 1e-3 * w) {
    rate_ = target_;
    slope_ = 0;
  }
  rate_ = std::max(0.0, rate_);
  return 0.5 * (before + rate_) * dt;
}

}  // namespace berth::testbed
