// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "testbed/motion/arm_motion.h"

namespace berth::testbed {

/// The way that both arms came, for a retreat to go back on.
class TrajectoryHistory {
 public:
  /// cell must outlive this.
  explicit TrajectoryHistory(const Cell& cell) : cell_(cell) {}

  void begin(const ArmPair& start);
  /// Where the arms are told to be now; noted when it is far enough from the last place.
  void add(const ArmPair& joints);
  void clear();
  /// Nothing has moved since the last retreat.
  bool empty() const { return points_.size() < 2; }
  /// From where the arms stand to where the trail began.
  std::shared_ptr<const ArmMotion> way_back(const ArmPair& from,
                                            const RelativeLimits& limits) const;

 private:
  double travel_between(const ArmPair& a, const ArmPair& b) const;

  const Cell& cell_;
  std::vector<ArmPair> points_;
  std::vector<double> lengths_;  // of relative travel between the points, m
};

}  // namespace berth::testbed
