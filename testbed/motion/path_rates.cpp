// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/path_rates.h"

#include <cmath>

#include "common/core/text.h"
#include "testbed/motion/arm_name.h"
#include "testbed/motion/motion_profile.h"

namespace berth::testbed {
namespace {

/// Six joints and, behind them, the motor of J3.
constexpr std::size_t coordinates = 7;
using Coordinates = std::array<double, coordinates>;

Coordinates coordinates_of(const ArmKinematics& arm, const Joints& q) {
  Coordinates values{};
  std::copy(q.begin(), q.end(), values.begin());
  values[6] = arm.motor_joints(q)[2];
  return values;
}

std::string joint_name(std::size_t joint) {
  return joint == 6 ? "J2 + J3 (motor of J3)" : "J" + std::to_string(joint + 1);
}

/// The rate of time at which the acceleration of a hold is just at its limit. While a hold brings
/// time to rest, joints decelerate by speed * (slope of time) besides what the path itself asks.
double holdable_rate(double speed, double acceleration, double limit, double frequency) {
  double least = std::sqrt(limit / std::max(acceleration, 1e-12));
  for (const double x : {0.25, 0.5, 0.75, 1.0}) {  // frequency * time since the hold
    const double decay = std::exp(-x);
    const double square = acceleration * (1 + x) * (1 + x) * decay * decay;
    const double linear = speed * frequency * x * decay;
    const double root = std::sqrt(linear * linear + 4 * square * limit);
    least = std::min(least, 2 * limit / std::max(linear + root, 1e-12));
  }
  return least;
}

class Search {
 public:
  Search(const Cell& cell, const std::vector<PathSample>& samples, const RateLimits& limits)
      : cell_(cell), samples_(samples), limits_(limits) {}

  std::optional<RateExcess> worst() {
    for (const ArmRole role : both_arms) look_at(role);
    return worst_;
  }

 private:
  enum class Kind { speed, acceleration, hold, jerk };

  void look_at(ArmRole role) {
    const ArmKinematics& arm = *cell_.arm(role).kinematics;
    const double frequency = TimeScale::frequency(limits_.hold_settling);
    constexpr double steepest = 0.3679;  // of x exp(-x)
    Coordinates before = coordinates_of(arm, samples_[0].joints.of(role));
    Coordinates last_speed{};
    Coordinates last_acceleration{};
    for (std::size_t k = 1; k < samples_.size(); ++k) {
      const double dt = samples_[k].time - samples_[k - 1].time;
      const double dt_before = k > 1 ? samples_[k - 1].time - samples_[k - 2].time : dt;
      const Coordinates here = coordinates_of(arm, samples_[k].joints.of(role));
      for (std::size_t i = 0; i < coordinates; ++i) {
        const JointLimit& limit = arm.limits()[i == 6 ? 2 : i];
        const double speed = (here[i] - before[i]) / dt;
        const double max_speed = limits_.speed * limit.speed;
        if (std::abs(speed) > max_speed) {
          note(Kind::speed, role, i, k, std::abs(speed), max_speed, max_speed / std::abs(speed));
        }
        if (k == 1) {
          last_speed[i] = speed;
          continue;
        }
        const double acceleration = 2 * (speed - last_speed[i]) / (dt + dt_before);
        const double most = limits_.acceleration * limit.acceleration;
        const double a = std::abs(acceleration);
        const double v = std::max(std::abs(speed), std::abs(last_speed[i]));
        if (a + v * frequency * steepest > most) {
          const double rate = holdable_rate(v, a, most, frequency);
          if (a > most) {
            note(Kind::acceleration, role, i, k - 1, a, most, std::min(rate, std::sqrt(most / a)));
          } else if (rate < 1) {
            note(Kind::hold, role, i, k - 1, a + v * frequency * steepest, most, rate);
          }
        }
        if (k > 2) {
          const double jerk = std::abs(acceleration - last_acceleration[i]) / dt_before;
          const double max_jerk = most / limits_.rise_time;
          if (jerk > max_jerk) {
            note(Kind::jerk, role, i, k - 1, jerk, max_jerk, std::cbrt(max_jerk / jerk));
          }
        }
        last_speed[i] = speed;
        last_acceleration[i] = acceleration;
      }
      before = here;
    }
  }

  void note(Kind kind, ArmRole role, std::size_t joint, std::size_t sample, double value,
            double limit, double rate) {
    if (worst_ && rate >= worst_->passing_rate) return;
    const bool linear = joint < 6 && cell_.arm(role).kinematics->is_linear(static_cast<int>(joint));
    const double scale = linear ? 1e3 : degrees(1.0);
    std::string unit = linear ? " mm/s" : " deg/s";
    if (kind == Kind::jerk) unit += "^3";
    if (kind == Kind::acceleration || kind == Kind::hold) unit += "^2";
    worst_ =
        RateExcess{samples_[sample].time, samples_[sample].joints,
                   arm_name(role) + "'s " + joint_name(joint) + " would need " +
                       fixed(scale * value, 1) + unit + (kind == Kind::hold ? " to hold" : "") +
                       ", limit " + fixed(scale * limit, 1) + unit,
                   rate};
  }

  const Cell& cell_;
  const std::vector<PathSample>& samples_;
  const RateLimits& limits_;
  std::optional<RateExcess> worst_;
};

}  // namespace

std::optional<RateExcess> excess_of(const Cell& cell, const std::vector<PathSample>& samples,
                                    const RateLimits& limits) {
  return samples.size() < 2 ? std::nullopt : Search(cell, samples, limits).worst();
}

}  // namespace berth::testbed
