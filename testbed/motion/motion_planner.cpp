// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/motion_planner.h"

#include <algorithm>

namespace berth::testbed {
namespace {

/// Sharings that are checked closely besides the nominal one.
constexpr std::size_t max_checks = 5;

}  // namespace

MotionPlanner::Result MotionPlanner::plan(std::shared_ptr<const RelativePath> path,
                                          const ArmPair& start, FrozenArm frozen) const {
  std::optional<Refusal> refusal;
  const auto attempt = [&](const RedundancyResolution& sharing) -> std::optional<Plan> {
    Plan plan{
        std::make_shared<const RelativeMotion>(path, ArmAllocation(cell_, sharing, frozen, start)),
        sharing};
    const auto wrong = check_.check(*plan.motion, start);
    if (!wrong) return plan;
    if (!refusal || wrong->passing_rate > refusal->passing_rate) refusal = wrong;
    return std::nullopt;
  };
  RedundancyResolution nominal;
  nominal.travel = cell_.sensor_share;
  // a frozen arm leaves no choice, and neither does standing still
  const bool choice = frozen == FrozenArm::none && path->duration() > 0;
  if (!choice || search_.quality(*path, start, nominal) >= RedundancySearch::comfortable) {
    if (auto plan = attempt(nominal)) return *std::move(plan);
    if (!choice) return *refusal;
  }
  std::vector<RedundancySearch::Found> found = search_.best(*path, start, nominal);
  if (found.size() > max_checks) found.resize(max_checks);
  for (const auto& [sharing, quality] : found) {
    if (quality < 0) break;
    if (auto plan = attempt(sharing)) return *std::move(plan);
  }
  if (auto plan = attempt(nominal)) return *std::move(plan);
  return *refusal;
}

}  // namespace berth::testbed
