// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <variant>

#include "testbed/arm_motion.h"

namespace berth::testbed {

/// Finds a motion of both arms for a motion of the replica in the sensor frame. The travel is
/// shared out by the layout's nominal share; where that does not pass the check, other shares and
/// places in the cell are tried, best margin first.
class MotionPlanner {
 public:
  MotionPlanner(const Cell& cell, const PathCheck& check) : cell_(cell), check_(check) {}

  struct Plan {
    std::shared_ptr<const ArmMotion> motion;
    Sharing sharing;
  };
  using Result = std::variant<Plan, Refusal>;

  /// The path must begin where the arms stand.
  Result plan(std::shared_ptr<const RelativePath> path, const ArmPair& start,
              FrozenArm frozen) const;

 private:
  struct Candidate;
  double margin(const ArmMotion& motion, const ArmPair& start) const;

  const Cell& cell_;
  const PathCheck& check_;
};

}  // namespace berth::testbed
