// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <variant>

#include "testbed/motion/redundancy_search.h"

namespace berth::testbed {

/// Finds a motion of both arms for a motion of the replica in the sensor frame. The travel is
/// shared out as the layout says where that is comfortable for both arms, else as a search finds
/// best; a sharing that does not pass the check gives way to the next best.
class MotionPlanner {
 public:
  MotionPlanner(const Cell& cell, const PathCheck& check, Clearance& clearance)
      : cell_(cell), check_(check), search_(cell, check.limits(), clearance) {}

  struct Plan {
    std::shared_ptr<const ArmMotion> motion;
    RedundancyResolution sharing;
  };
  using Result = std::variant<Plan, Refusal>;

  /// The path must begin where the arms stand. A refusal is the one of the sharing that would pass
  /// fastest.
  Result plan(std::shared_ptr<const RelativePath> path, const ArmPair& start,
              FrozenArm frozen) const;

 private:
  const Cell& cell_;
  const PathCheck& check_;
  RedundancySearch search_;
};

}  // namespace berth::testbed
