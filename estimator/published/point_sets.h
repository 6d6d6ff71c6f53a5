// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// Points that may be the target, with their principal axes.
struct PointSet {
  std::vector<Vector3d> points;  ///< sensor frame, m
  Vector3d centroid = Vector3d::Zero();
  Vector3d axis = Vector3d::UnitX();    ///< major axis, unit
  Vector3d second = Vector3d::UnitY();  ///< middle axis, unit
  double elongation = 1;                ///< spread along the major axis over that along the middle
};

/// Size of the target, m.
struct TargetSize {
  double half_length = 0;  ///< along the major axis
  double radius = 0;       ///< across it
};

/// Centroid and principal axes of points.
void find_axes(PointSet& set);

/// Candidate segmentations of a cluttered scan: all points, depth slices behind the nearest
/// returns, connected clusters of these, and each trimmed to the target's size about its axis.
/// Arms, mounts and walls behind the target are absent from some of them. Duplicates are removed.
std::vector<PointSet> candidate_point_sets(const std::vector<Vector3d>& points,
                                           const TargetSize& size, std::size_t at_most);

}  // namespace berth::estimator
