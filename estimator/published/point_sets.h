// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// Points that may be the target, with the axis that PCA finds in them.
struct PointSet {
  std::vector<Vector3d> points;  ///< sensor frame, m
  Vector3d centroid = Vector3d::Zero();
  Vector3d axis = Vector3d::UnitX();    ///< major axis, unit
  Vector3d second = Vector3d::UnitY();  ///< middle axis, unit
  double elongation = 1;                ///< spread along the major axis over that along the middle
};

/// Size of what is looked for, m.
struct TargetSize {
  double half_length = 0;  ///< along the major axis
  double radius = 0;       ///< across it
};

/// Centroid and principal axes of points.
void find_axes(PointSet& set);

/// Guesses which points of a cluttered scan are the target's: everything, slices of depth behind
/// the nearest returns, connected clusters of these, and each of them trimmed to the target's
/// length and width about its own axis. Arms, mounts and walls stand behind the target and drop out
/// of some of them. Sets that say the same as an earlier one are left out.
std::vector<PointSet> candidate_point_sets(const std::vector<Vector3d>& points,
                                           const TargetSize& size, std::size_t at_most);

}  // namespace berth::estimator
