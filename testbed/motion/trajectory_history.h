// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "testbed/motion/motion_profile.h"
#include "testbed/motion/path_check.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// Motion along joints that the arms have passed before, on a cubic spline whose velocity and
/// acceleration are continuous: the way back is as free of collisions as the way there.
class RecordedMotion final : public ArmMotion {
 public:
  /// points: beginning at the arms' present joints; lengths: of relative travel between them (one
  /// less), in the unit that `travel` counts.
  RecordedMotion(std::vector<ArmPair> points, const std::vector<double>& lengths, double speed,
                 double acceleration, double jerk);

  double duration() const override { return travel_.duration(); }
  std::optional<ArmPair> at(double t, const ArmPair& near, std::string* reason) const override;

 private:
  std::vector<ArmPair> points_;
  std::vector<double> position_;  // of each point along the way
  std::vector<ArmPair> bend_;     // second derivative at each point
  SmoothTravel travel_;
};

/// The joints that both arms have passed, for a retreat along them.
class TrajectoryHistory {
 public:
  /// cell must outlive this.
  explicit TrajectoryHistory(const Cell& cell) : cell_(cell) {}

  void begin(const ArmPair& start);
  /// Adds commanded joints when they are far enough from the last point.
  void add(const ArmPair& joints);
  void clear();
  /// No motion since the last retreat.
  bool empty() const { return points_.size() < 2; }
  /// From the arms' present joints to the beginning of the history.
  std::shared_ptr<const ArmMotion> way_back(const ArmPair& from,
                                            const RelativeLimits& limits) const;

 private:
  double travel_between(const ArmPair& a, const ArmPair& b) const;

  const Cell& cell_;
  std::vector<ArmPair> points_;
  std::vector<double> lengths_;  // of relative travel between the points, m
};

}  // namespace berth::testbed
