// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion_planner.h"

#include <algorithm>

namespace berth::testbed {
namespace {

/// Places of a path at which a sharing is judged before it is checked closely.
constexpr int margin_samples = 12;
/// Sharings that are checked closely besides the nominal one.
constexpr std::size_t most_checks = 5;
/// rad of joint margin that counts as plenty.
constexpr double plenty = 1.0;

std::vector<Sharing> alternatives(double nominal_share) {
  std::vector<Sharing> list;
  for (const double side : {0.0, 0.3, -0.4, -0.8}) {
    for (const double up : {0.0, 0.25, -0.25}) {
      for (const double along : {0.0, 0.3, -0.3}) {
        for (const double lateral : {0.0, 0.5}) {
          Sharing sharing;
          sharing.travel = nominal_share;
          sharing.lateral = lateral;
          sharing.shift = Vector3d(along, side, up);
          list.push_back(sharing);
        }
      }
    }
  }
  return list;
}

double joint_margin(const ArmKinematics& arm, const Joints& q) {
  double margin = plenty;
  for (std::size_t i = 0; i < 6; ++i) {
    if (arm.is_linear(static_cast<int>(i))) continue;
    margin = std::min({margin, q[i] - arm.limits()[i].low, arm.limits()[i].high - q[i]});
  }
  return margin;
}

}  // namespace

struct MotionPlanner::Candidate {
  std::shared_ptr<const ArmMotion> motion;
  Sharing sharing;
  double margin = 0;
};

double MotionPlanner::margin(const ArmMotion& motion, const ArmPair& start) const {
  // Small steps keep the branch; each place is judged by its worse arm.
  constexpr int steps_between = 3;
  ArmPair near = start;
  double least = plenty;
  for (int k = 0; k <= margin_samples * steps_between; ++k) {
    const double t = motion.duration() * k / (margin_samples * steps_between);
    const auto joints = motion.at(t, near, nullptr);
    if (!joints || largest_change(near, *joints) > 0.8) return 0;
    near = *joints;
    if (k % steps_between != 0) continue;
    for (const ArmRole role : both_arms) {
      const ArmKinematics& arm = *cell_.arm(role).kinematics;
      if (!arm.limit_violation(near.of(role)).empty()) return 0;
      least = std::min(
          {least, joint_margin(arm, near.of(role)), 4 * arm.manipulability(near.of(role))});
    }
  }
  return least;
}

MotionPlanner::Result MotionPlanner::plan(std::shared_ptr<const RelativePath> path,
                                          const ArmPair& start, FrozenArm frozen) const {
  const auto make = [&](const Sharing& sharing) {
    return std::make_shared<const RelativeMotion>(path,
                                                  ArmAllocation(cell_, sharing, frozen, start));
  };
  Sharing nominal;
  nominal.travel = cell_.sensor_share;
  Plan plan{make(nominal), nominal};
  const auto refusal = check_.check(*plan.motion, start);
  if (!refusal) return plan;
  // a path that is only too fast is too fast for the operator to decide; a frozen arm leaves no
  // choice
  if (refusal->passing_rate > 0 || frozen != FrozenArm::none) return *refusal;

  std::vector<Candidate> candidates;
  for (const Sharing& sharing : alternatives(nominal.travel)) {
    Candidate candidate{make(sharing), sharing, 0};
    candidate.margin = margin(*candidate.motion, start);
    if (candidate.margin > 0) candidates.push_back(std::move(candidate));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.margin > b.margin; });
  if (candidates.size() > most_checks) candidates.resize(most_checks);
  for (const Candidate& candidate : candidates) {
    if (!check_.check(*candidate.motion, start)) return Plan{candidate.motion, candidate.sharing};
  }
  return *refusal;
}

}  // namespace berth::testbed
