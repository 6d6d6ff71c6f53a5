// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/path_check.h"

#include <cmath>

#include "common/core/text.h"
#include "testbed/motion/arm_name.h"

namespace berth::testbed {
namespace {

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
  // Rates last: they depend on how fast it is done.
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
  path.push_back({0, start});  // dropped below: the motion says where it begins
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
      const double farther = fine_turn / std::max(largest_change(before, last.joints), 1e-9);
      if (const auto beyond = check_joints(blend(before, last.joints, 1 + farther))) {
        text += "; " + *beyond;
      }
    }
    return Refusal{text, t, 0};
  }
  path.push_back({t, *joints});
  return std::nullopt;
}

/// Looked at again only when a joint may have turned into a singularity since.
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

std::optional<Refusal> PathCheck::look(const PathSample& sample, double& spare) const {
  const Clearance::Result near = clearance_.worst(sample.joints, far);
  if (near.slack < 0) {
    return Refusal{place(sample.time, sample.joints) + too_near(near), sample.time, 0};
  }
  spare = near.slack;
  return std::nullopt;
}

/// Continuous: bodies are looked at again before they can have come closer by what there was to
/// spare, between samples too.
std::optional<Refusal> PathCheck::check_clearance(const Path& path) const {
  double spare = 0;
  if (auto refusal = look(path.front(), spare)) return refusal;
  for (std::size_t k = 1; k < path.size(); ++k) {
    if (auto refusal = check_between(path[k - 1], path[k], spare)) return refusal;
  }
  return path.size() > 1 ? look(path.back(), spare) : std::nullopt;
}

std::optional<Refusal> PathCheck::check_between(const PathSample& a, const PathSample& b,
                                                double& spare) const {
  const double approach = clearance_.approach_bound(a.joints, b.joints);
  if (approach < spare) {
    spare -= approach;
    return std::nullopt;
  }
  if (auto refusal = look(a, spare)) return refusal;
  if (approach < spare) {
    spare -= approach;
    return std::nullopt;
  }
  if (approach < limits_.clearance_blind) return look(b, spare);
  const PathSample middle{0.5 * (a.time + b.time), blend(a.joints, b.joints, 0.5)};
  if (auto refusal = check_between(a, middle, spare)) return refusal;
  return check_between(middle, b, spare);
}

}  // namespace berth::testbed
