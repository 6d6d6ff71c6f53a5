// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/path_check.h"

#include <cmath>

#include "common/core/text.h"
#include "testbed/motion/arm_pair.h"
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
/// time to rest, joints decelerate by speed * (slope of time) in addition to the path's own
/// acceleration.
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
    for (const ArmRole role : both_arms) check_arm(role);
    return worst_;
  }

 private:
  enum class Kind { speed, acceleration, hold, jerk };

  void check_arm(ArmRole role) {
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

constexpr double min_samples = 30;
constexpr double max_samples = 4000;
/// A rotary joint turns no farther between two samples, rad, while halving the interval helps.
constexpr double fine_turn = 0.05;
constexpr int max_halvings = 7;
/// Manipulability changes by no more than this for a joint's turn of 1 rad: each column of the
/// Jacobian, scaled by the arm's reach, is at most as long as sqrt(2), and so is its change.
constexpr double manipulability_slope = 4;
/// Bodies farther apart than this are far: m.
constexpr double far = 0.5;

/// Largest change of any rotary joint, rad: a linear axis has no other configuration.
double largest_turn(const Cell& cell, const ArmPair& a, const ArmPair& b) {
  double largest = 0;
  for (const ArmRole role : both_arms) {
    for (std::size_t i = 0; i < 6; ++i) {
      if (cell.arm(role).kinematics->is_linear(static_cast<int>(i))) continue;
      largest = std::max(largest, std::abs(a.of(role)[i] - b.of(role)[i]));
    }
  }
  return largest;
}

/// Of one arm's rotary joints, rad.
double sum_of_turns(const ArmKinematics& arm, const Joints& a, const Joints& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!arm.is_linear(static_cast<int>(i))) sum += std::abs(a[i] - b[i]);
  }
  return sum;
}

std::string too_near(const Clearance::Result& near) {
  return near.a + " comes within " + fixed(1e3 * near.distance, 0) + " mm of " + near.b +
         ", limit " + fixed(1e3 * (near.distance - near.slack), 0) + " mm";
}

}  // namespace

std::optional<RateExcess> excess_of(const Cell& cell, const std::vector<PathSample>& samples,
                                    const RateLimits& limits) {
  return samples.size() < 2 ? std::nullopt : Search(cell, samples, limits).worst();
}

std::string PathCheck::place(double t, const ArmPair& joints) const {
  const Xyzwpr v = xyzwpr_from_pose(cell_.relative_pose(joints.replica, joints.sensor));
  std::string text = "at " + fixed(t, 1) + " s, relative pose (";
  for (std::size_t i = 0; i < 6; ++i) {
    if (i > 0) text += ", ";
    text += fixed(v[i], i < 3 ? 0 : 1);
  }
  return text + "): ";
}

std::optional<std::string> PathCheck::check_joints(const ArmPair& joints) const {
  for (const ArmRole role : both_arms) {
    const std::string violation = cell_.arm(role).kinematics->limit_violation(joints.of(role));
    if (!violation.empty()) return arm_name(role) + ": " + violation;
  }
  return std::nullopt;
}

std::optional<std::string> PathCheck::check_singularity(const ArmPair& joints,
                                                        double& value) const {
  value = 1;
  for (const ArmRole role : both_arms) {
    const double here = cell_.arm(role).kinematics->manipulability(joints.of(role));
    value = std::min(value, here);
    if (here < limits_.manipulability) {
      return arm_name(role) + " comes near a singularity: manipulability " + fixed(here, 3) +
             ", limit " + fixed(limits_.manipulability, 3);
    }
  }
  return std::nullopt;
}

std::optional<std::string> PathCheck::check(const ArmPair& joints) const {
  if (auto wrong = check_joints(joints)) return wrong;
  double manipulability = 0;
  if (auto wrong = check_singularity(joints, manipulability)) return wrong;
  const Clearance::Result near = clearance_.worst(joints, limits_.clearance_step);
  if (near.slack < 0) return too_near(near);
  return std::nullopt;
}

std::optional<Refusal> PathCheck::check(const ArmMotion& motion, const ArmPair& start) const {
  Path path;
  if (auto refusal = sample(motion, start, path)) return refusal;
  if (auto refusal = check_singularities(path)) return refusal;
  if (auto refusal = check_clearance(path)) return refusal;
  // Rates last: only they depend on the motion's speed.
  if (const auto excess = excess_of(cell_, path, limits_.rates)) {
    return Refusal{place(excess->time, excess->joints) + excess->text, excess->time,
                   0.99 * excess->passing_rate};
  }
  return std::nullopt;
}

std::optional<Refusal> PathCheck::sample(const ArmMotion& motion, const ArmPair& start,
                                         Path& path) const {
  const double duration = motion.duration();
  const double count =
      std::clamp(std::ceil(duration / limits_.sample_time), min_samples, max_samples);
  path.reserve(static_cast<std::size_t>(count) + 2);
  path.push_back({0, start});  // dropped below: the motion defines its own first sample
  if (auto refusal = sample_to(motion, 0, 0, path)) return refusal;
  path.erase(path.begin());
  for (int k = 1; duration > 0 && k <= static_cast<int>(count); ++k) {
    if (auto refusal = sample_to(motion, duration * k / count, max_halvings, path)) {
      return refusal;
    }
  }
  return std::nullopt;
}

std::optional<Refusal> PathCheck::sample_to(const ArmMotion& motion, double t, int halvings,
                                            Path& path) const {
  const PathSample last = path.back();
  std::string reason;
  const auto joints = motion.at(t, last.joints, &reason);
  const double turn = joints ? largest_turn(cell_, last.joints, *joints) : fine_turn;
  if (halvings > 0 && turn >= fine_turn) {
    if (auto refusal = sample_to(motion, 0.5 * (last.time + t), halvings - 1, path)) return refusal;
    return sample_to(motion, t, halvings - 1, path);
  }
  if (!joints) return Refusal{place(t, last.joints) + reason, t, 0};
  if (auto wrong = check_joints(*joints)) return Refusal{place(t, *joints) + *wrong, t, 0};
  if (turn > limits_.largest_step) {
    std::string text = place(t, last.joints) + "an arm would have to change its configuration";
    // a branch ends where a joint would pass its limit
    if (path.size() >= 2) {
      const ArmPair& before = path[path.size() - 2].joints;
      const double farther = fine_turn / std::max(max_change(before, last.joints), 1e-9);
      if (const auto beyond = check_joints(blend(before, last.joints, 1 + farther))) {
        text += "; " + *beyond;
      }
    }
    return Refusal{text, t, 0};
  }
  path.push_back({t, *joints});
  return std::nullopt;
}

/// Evaluated again only when a joint may have reached a singularity since.
std::optional<Refusal> PathCheck::check_singularities(const Path& path) const {
  double spare = 0;
  double turned = 0;
  for (std::size_t k = 0; k < path.size(); ++k) {
    if (k > 0) {
      double most = 0;
      for (const ArmRole role : both_arms) {
        most = std::max(most, sum_of_turns(*cell_.arm(role).kinematics, path[k - 1].joints.of(role),
                                           path[k].joints.of(role)));
      }
      turned += most;
    }
    if (k > 0 && manipulability_slope * turned < spare) continue;
    double value = 0;
    if (auto wrong = check_singularity(path[k].joints, value)) {
      return Refusal{place(path[k].time, path[k].joints) + *wrong, path[k].time, 0};
    }
    spare = value - limits_.manipulability;
    turned = 0;
  }
  return std::nullopt;
}

std::optional<Refusal> PathCheck::check_clearance_at(const PathSample& sample,
                                                     double& spare) const {
  const Clearance::Result near = clearance_.worst(sample.joints, far);
  if (near.slack < 0) {
    return Refusal{place(sample.time, sample.joints) + too_near(near), sample.time, 0};
  }
  spare = near.slack;
  return std::nullopt;
}

/// Continuous collision check: clearance is evaluated again before bodies can have approached by
/// the last slack, also between samples.
std::optional<Refusal> PathCheck::check_clearance(const Path& path) const {
  double spare = 0;
  if (auto refusal = check_clearance_at(path.front(), spare)) return refusal;
  for (std::size_t k = 1; k < path.size(); ++k) {
    if (auto refusal = check_between(path[k - 1], path[k], spare)) return refusal;
  }
  return path.size() > 1 ? check_clearance_at(path.back(), spare) : std::nullopt;
}

std::optional<Refusal> PathCheck::check_between(const PathSample& a, const PathSample& b,
                                                double& spare) const {
  const double approach = clearance_.approach_bound(a.joints, b.joints);
  if (approach < spare) {
    spare -= approach;
    return std::nullopt;
  }
  if (auto refusal = check_clearance_at(a, spare)) return refusal;
  if (approach < spare) {
    spare -= approach;
    return std::nullopt;
  }
  if (approach < limits_.clearance_blind) return check_clearance_at(b, spare);
  const PathSample middle{0.5 * (a.time + b.time), blend(a.joints, b.joints, 0.5)};
  if (auto refusal = check_between(a, middle, spare)) return refusal;
  return check_between(middle, b, spare);
}

}  // namespace berth::testbed
