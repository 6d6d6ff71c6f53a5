// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/trajectory_history.h"

#include <algorithm>

namespace berth::testbed {
namespace {

/// Of the trail, in m of relative travel.
constexpr double spacing = 0.002;
/// m of relative travel that a radian counts for.
constexpr double lever = 1.5;

}  // namespace

double TrajectoryHistory::travel_between(const ArmPair& a, const ArmPair& b) const {
  const Pose from = cell_.relative_pose(a.replica, a.sensor);
  const Pose to = cell_.relative_pose(b.replica, b.sensor);
  return std::max({distance(from, to), lever * angle_between(from, to), 1e-6});
}

void TrajectoryHistory::begin(const ArmPair& start) {
  points_ = {start};
  lengths_.clear();
}

void TrajectoryHistory::add(const ArmPair& joints) {
  const double length = travel_between(points_.back(), joints);
  if (length < spacing) return;
  points_.push_back(joints);
  lengths_.push_back(length);
}

void TrajectoryHistory::clear() {
  points_.clear();
  lengths_.clear();
}

std::shared_ptr<const ArmMotion> TrajectoryHistory::way_back(const ArmPair& from,
                                                             const RelativeLimits& limits) const {
  std::vector<ArmPair> points(points_.rbegin(), points_.rend());
  std::vector<double> lengths(lengths_.rbegin(), lengths_.rend());
  if (largest_change(from, points.front()) > 1e-6) {
    lengths.insert(lengths.begin(), travel_between(from, points.front()));
    points.insert(points.begin(), from);
  }
  return std::make_shared<const RecordedMotion>(std::move(points), lengths, limits.speed,
                                                limits.acceleration,
                                                4 * limits.acceleration / limits.rise_time);
}

}  // namespace berth::testbed
