// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquire/range_image.h"
#include "estimator/model/view_templates.h"

namespace berth::estimator {

/// A pose that a template proposes.
struct Placement {
  Pose pose;         ///< T_sensor_model
  double score = 0;  ///< beams, about: those explained less those that speak against it
};

/// Lays every template, turned about the line of sight, with its anchors on returns, and keeps the
/// best placements. Needs no guess of what of a scan is the target.
/// @param points returns that may be the target's, sensor frame, m
/// @param anchors those of them that templates are laid on
/// @param hiding of each beam, whether it ended on something else: what is behind may be there
/// @param centre, radius, length of the target, model frame, m
/// @param max_cost of a beam, where a point of a template has no return: at most 1.5, which is 0.5
/// and 1 more where it is seen through
std::vector<Placement> match_templates(const RangeImage& image, const std::vector<Vector3d>& points,
                                       const std::vector<Vector3d>& anchors,
                                       const std::vector<char>& hiding,
                                       const std::vector<ViewTemplate>& templates,
                                       const Vector3d& centre, double radius, double length,
                                       double max_cost, std::size_t placements);

}  // namespace berth::estimator
