// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/external_guidance.h"

#include <algorithm>

#include "common/core/text.h"
#include "testbed/guidance/chaser.h"

namespace berth::testbed {
namespace {

/// 1/s: gain of the velocity control.
constexpr double response = 4;
/// s over which the arms move to the flight's redundancy resolution.
constexpr double glide = 30;

}  // namespace

ExternalFlight::ExternalFlight(std::string commander, const RelativeLimits& limits,
                               const Pose& commanded)
    : commander_(std::move(commander)),
      limits_(limits),
      chaser_(GuidanceProfile{}, limits, commanded.inverse()) {}

Steering::Output ExternalFlight::step(std::int64_t now, double dt) {
  time_ += dt;
  Velocity reference;
  reason_.clear();
  if (setpoint_.utime_expires == 0) {
    reason_ = "no set-point of '" + commander_ + "' has come yet";
  } else if (now > setpoint_.utime_expires) {
    reason_ = "the last set-point of '" + commander_ + "' has expired";
  } else {
    const Quaterniond& attitude = chaser_.pose().rotation;
    reference.linear = attitude * shortened(setpoint_.velocity.linear, limits_.speed);
    reference.angular = attitude * shortened(setpoint_.velocity.angular, limits_.angular_speed);
  }
  chaser_.step(dt, response * (reference.linear - chaser_.velocity().linear),
               response * (reference.angular - chaser_.velocity().angular));
  Output output;
  output.commanded = chaser_.pose().inverse();
  output.phase = reason_.empty() ? Phase::flying : Phase::holding;
  output.reason = reason_;
  const double x = std::min(1.0, time_ / glide);
  output.progress = x * x * (3 - 2 * x);
  return output;
}

GuidanceReport ExternalFlight::report() const {
  GuidanceReport report;
  report.profile = commander_;
  report.law = "outside";
  report.phase = reason_.empty() ? GuidanceReport::Phase::guided : GuidanceReport::Phase::holding;
  report.reason = reason_;
  report.orbit_time = time_;
  report.closing_speed = -chaser_.pose().position.normalized().dot(chaser_.velocity().linear);
  return report;
}

}  // namespace berth::testbed
