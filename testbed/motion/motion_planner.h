// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "testbed/motion/arm_allocation.h"

namespace berth::testbed {

/// Redundancy resolution of a relative path by a deterministic pattern search (compass search with
/// step halving) over the parameters of a RedundancyResolution. The objective is quality(): margins
/// of both arms to joint limits, singularities, speed limits and obstacles.
class RedundancySearch {
 public:
  RedundancySearch(const Cell& cell, const PathLimits& limits, Clearance& clearance)
      : cell_(cell), limits_(limits), clearance_(clearance) {}

  /// A resolution of this quality is taken without a search.
  static constexpr double comfortable = 0.8;

  /// 1: ample margins everywhere; 0: at a limit somewhere; below: infeasible, the lower the earlier
  /// on the path. The margins of each place, the worst of both arms, in the mean of their inverse
  /// fourth powers: the worst places count for most.
  double quality(const RelativePath& path, const ArmPair& start,
                 const RedundancyResolution& resolution) const;

  struct Found {
    RedundancyResolution resolution;
    double quality = 0;
  };
  /// The best resolutions found around the nominal one, and the starting points: best first.
  std::vector<Found> best(const RelativePath& path, const ArmPair& start,
                          const RedundancyResolution& nominal) const;

 private:
  double margin(const ArmPair& before, const ArmPair& joints, double dt, bool clearance) const;

  const Cell& cell_;
  const PathLimits& limits_;
  Clearance& clearance_;
};

/// Plans a motion of both arms for a motion of the replica in the sensor frame. It takes the
/// nominal resolution of the layout where its quality suffices, else the best of a search; after a
/// resolution that does not pass the check it tries the next best.
class MotionPlanner {
 public:
  MotionPlanner(const Cell& cell, const PathCheck& check, Clearance& clearance)
      : cell_(cell), check_(check), search_(cell, check.limits(), clearance) {}

  struct Plan {
    std::shared_ptr<const ArmMotion> motion;
    RedundancyResolution resolution;
  };
  using Result = std::variant<Plan, Refusal>;

  /// The path must begin at the arms' present pose. A refusal is the one of the resolution that
  /// would pass fastest.
  Result plan(std::shared_ptr<const RelativePath> path, const ArmPair& start,
              FrozenArm frozen) const;

 private:
  const Cell& cell_;
  const PathCheck& check_;
  RedundancySearch search_;
};

}  // namespace berth::testbed
