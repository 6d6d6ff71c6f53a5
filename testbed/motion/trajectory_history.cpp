// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/trajectory_history.h"

#include <algorithm>

namespace berth::testbed {
namespace {

/// Second derivatives of the natural cubic spline through values at increasing positions (the
/// tridiagonal system solved by elimination).
std::vector<double> spline_bends(const std::vector<double>& at, const std::vector<double>& values) {
  const std::size_t n = values.size();
  std::vector<double> bends(n, 0);
  std::vector<double> factor(n, 0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = at[i] - at[i - 1];
    const double after = at[i + 1] - at[i];
    const double kink = (values[i + 1] - values[i]) / after - (values[i] - values[i - 1]) / before;
    const double pivot = 2 * (before + after) - before * factor[i - 1];
    factor[i] = after / pivot;
    bends[i] = (6 * kink - before * bends[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) bends[i] -= factor[i] * bends[i + 1];
  return bends;
}

/// Between the points of the history, m of relative travel.
constexpr double spacing = 0.002;
/// m of relative travel that a radian counts for.
constexpr double lever = 1.5;

}  // namespace

RecordedMotion::RecordedMotion(std::vector<ArmPair> points, const std::vector<double>& lengths,
                               double speed, double acceleration, double jerk)
    : points_(std::move(points)), position_{0}, bend_(points_.size()) {
  for (const double length : lengths) position_.push_back(position_.back() + length);
  travel_ = SmoothTravel(position_.back(), speed, acceleration, jerk);
  std::vector<double> values(points_.size());
  for (const ArmRole role : both_arms) {
    for (std::size_t joint = 0; joint < 6 && points_.size() > 2; ++joint) {
      for (std::size_t i = 0; i < points_.size(); ++i) values[i] = points_[i].of(role)[joint];
      const std::vector<double> bends = spline_bends(position_, values);
      for (std::size_t i = 0; i < points_.size(); ++i) bend_[i].of(role)[joint] = bends[i];
    }
  }
}

std::optional<ArmPair> RecordedMotion::at(double t, const ArmPair&, std::string*) const {
  if (points_.size() == 1) return points_.front();
  const double position = travel_.position(t);
  const auto next = std::upper_bound(position_.begin() + 1, position_.end() - 1, position);
  const auto i = static_cast<std::size_t>(next - position_.begin());
  const double span = position_[i] - position_[i - 1];
  const double s = span > 0 ? std::clamp((position - position_[i - 1]) / span, 0.0, 1.0) : 1.0;
  ArmPair joints = blend(points_[i - 1], points_[i], s);
  const double of_first = ((1 - s) * (1 - s) - 1) * (1 - s) * span * span / 6;
  const double of_second = (s * s - 1) * s * span * span / 6;
  for (const ArmRole role : both_arms) {
    for (std::size_t joint = 0; joint < 6; ++joint) {
      joints.of(role)[joint] +=
          of_first * bend_[i - 1].of(role)[joint] + of_second * bend_[i].of(role)[joint];
    }
  }
  return joints;
}

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
  if (max_change(from, points.front()) > 1e-6) {
    lengths.insert(lengths.begin(), travel_between(from, points.front()));
    points.insert(points.begin(), from);
  }
  return std::make_shared<const RecordedMotion>(std::move(points), lengths, limits.speed,
                                                limits.acceleration,
                                                4 * limits.acceleration / limits.rise_time);
}

}  // namespace berth::testbed
