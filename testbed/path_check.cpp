// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/path_check.h"

#include <vector>

#include "common/core/text.h"

namespace berth::testbed {
namespace {

constexpr int fewest_samples = 30;
constexpr int most_samples = 600;

std::string arm_name(ArmRole role) { return std::string("the ") + name_of(role) + " arm"; }

std::string joint_name(std::size_t joint) {
  return joint == 6 ? "J2 + J3 (motor of J3)" : "J" + std::to_string(joint + 1);
}

/// Seven rates: six joints and, behind them, the motor of J3.
std::array<double, 7> with_motor(const ArmKinematics& arm, const Joints& q) {
  std::array<double, 7> values;
  std::copy(q.begin(), q.end(), values.begin());
  values[6] = arm.motor_joints(q)[2];
  return values;
}

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

}  // namespace

/// The joint whose speed or acceleration is the greatest part of its limit, over the whole motion.
struct PathCheck::Rates {
  double part = 0;
  double time = 0;
  ArmPair joints;
  ArmRole role = ArmRole::replica;
  std::size_t joint = 0;
  double value = 0;
  double limit = 0;
};

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

std::optional<std::string> PathCheck::check_singularity(const ArmPair& joints) const {
  for (const ArmRole role : both_arms) {
    const double value = cell_.arm(role).kinematics->manipulability(joints.of(role));
    if (value < limits_.manipulability) {
      return arm_name(role) + " comes near a singularity: manipulability " + fixed(value, 3) +
             ", limit " + fixed(limits_.manipulability, 3);
    }
  }
  return std::nullopt;
}

std::optional<std::string> PathCheck::check(const ArmPair& joints) const {
  if (auto wrong = check_joints(joints)) return wrong;
  if (auto wrong = check_singularity(joints)) return wrong;
  const Clearance::Result near = clearance_.worst(joints, limits_.clearance_step);
  if (near.slack < 0) {
    return near.a + " comes within " + fixed(1e3 * near.distance, 0) + " mm of " + near.b +
           ", limit " + fixed(1e3 * (near.distance - near.slack), 0) + " mm";
  }
  return std::nullopt;
}

std::optional<Refusal> PathCheck::check(const ArmMotion& motion, const ArmPair& start) const {
  const double duration = motion.duration();
  const int samples =
      std::clamp(static_cast<int>(duration / limits_.sample_time), fewest_samples, most_samples);
  const double dt = duration / samples;

  std::vector<ArmPair> path;
  path.reserve(static_cast<std::size_t>(samples) + 1);
  for (int k = 0; k <= samples; ++k) {
    const double t = k * dt;
    const ArmPair& near = path.empty() ? start : path.back();
    std::string reason;
    const auto joints = motion.at(t, near, &reason);
    if (!joints) return Refusal{place(t, near) + reason, t, 0};
    if (auto wrong = check_joints(*joints)) return Refusal{place(t, *joints) + *wrong, t, 0};
    if (largest_turn(cell_, near, *joints) > limits_.largest_step) {
      std::string text = place(t, near) + "an arm would have to change its configuration";
      // a branch ends where a joint would pass its limit
      if (path.size() >= 2) {
        const auto beyond = check_joints(blend(path[path.size() - 2], path.back(), 2));
        if (beyond) text += "; " + *beyond;
      }
      return Refusal{text, t, 0};
    }
    path.push_back(*joints);
  }

  // Looked at again only after the bodies may have come closer by what there was to spare.
  std::size_t looked = 0;
  double spare = -1;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const double t = static_cast<double>(k) * dt;
    const double moved = clearance_.motion_bound(path[looked], path[k]);
    const bool last = k + 1 == path.size();
    if (k > 0 && !last && 2 * moved < spare) continue;
    constexpr double far = 0.5;
    const Clearance::Result near = clearance_.worst(path[k], far);
    if (near.slack < 0) {
      return Refusal{place(t, path[k]) + near.a + " comes within " + fixed(1e3 * near.distance, 0) +
                         " mm of " + near.b + ", limit " +
                         fixed(1e3 * (near.distance - near.slack), 0) + " mm",
                     t, 0};
    }
    if (auto wrong = check_singularity(path[k])) return Refusal{place(t, path[k]) + *wrong, t, 0};
    looked = k;
    spare = std::max(near.slack, limits_.clearance_step);
  }

  // Speeds and accelerations last: they depend on how fast it is done.
  Rates speed;
  Rates acceleration;
  if (dt > 0) {
    for (std::size_t k = 1; k < path.size(); ++k) {
      for (const ArmRole role : both_arms) {
        const ArmKinematics& arm = *cell_.arm(role).kinematics;
        const auto before = with_motor(arm, path[k - 1].of(role));
        const auto here = with_motor(arm, path[k].of(role));
        const auto after = with_motor(arm, path[std::min(k + 1, path.size() - 1)].of(role));
        for (std::size_t i = 0; i < here.size(); ++i) {
          const JointLimit& limit = arm.limits()[i == 6 ? 2 : i];
          const double t = static_cast<double>(k) * dt;
          const double v = std::abs(here[i] - before[i]) / dt;
          const double a = std::abs(after[i] - 2 * here[i] + before[i]) / (dt * dt);
          const double v_limit = limits_.speed * limit.speed;
          const double a_limit = limits_.acceleration * limit.acceleration;
          if (v / v_limit > speed.part) {
            speed = {v / v_limit, t, path[k], role, i, v, v_limit};
          }
          if (k + 1 < path.size() && a / a_limit > acceleration.part) {
            acceleration = {a / a_limit, t, path[k], role, i, a, a_limit};
          }
        }
      }
    }
  }
  const double rate =
      std::min(1 / std::max(speed.part, 1e-9), 1 / std::sqrt(std::max(acceleration.part, 1e-9)));
  for (const Rates* rates : {&speed, &acceleration}) {
    if (rates->part <= 1) continue;
    const bool linear =
        rates->joint < 6 &&
        cell_.arm(rates->role).kinematics->is_linear(static_cast<int>(rates->joint));
    const double unit = linear ? 1e3 : degrees(1.0);
    const std::string name =
        rates == &speed ? (linear ? " mm/s" : " deg/s") : (linear ? " mm/s^2" : " deg/s^2");
    return Refusal{place(rates->time, rates->joints) + arm_name(rates->role) + "'s " +
                       joint_name(rates->joint) + " would need " + fixed(unit * rates->value, 1) +
                       name + ", limit " + fixed(unit * rates->limit, 1) + name,
                   rates->time, 0.99 * rate};
  }
  return std::nullopt;
}

}  // namespace berth::testbed
