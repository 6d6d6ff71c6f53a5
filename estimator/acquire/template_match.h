// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquire/range_image.h"
#include "estimator/model/view_templates.h"

namespace berth::estimator {

/// A pose proposed by a template.
struct Placement {
  Pose pose;         ///< T_sensor_model
  double score = 0;  ///< beams: number explained less number contradicted, about
};

/// Exhaustive template matching: every template, rotated about the line of sight, is placed with
/// its anchors on returns; the best placements are kept. Needs no segmentation of the target.
/// @param points returns that may be the target's, sensor frame, m
/// @param anchors those of them on which templates are placed
/// @param occluding of each beam, whether it ended on an occluder, behind which the target may be
/// @param centre, radius, length of the target, model frame, m
/// @param max_cost per beam, where a point of a template has no return: at most 1.5, which is 0.5
/// and 1 more where the beam passed
std::vector<Placement> match_templates(const RangeImage& image, const std::vector<Vector3d>& points,
                                       const std::vector<Vector3d>& anchors,
                                       const std::vector<char>& occluding,
                                       const std::vector<ViewTemplate>& templates,
                                       const Vector3d& centre, double radius, double length,
                                       double max_cost, std::size_t placements);

}  // namespace berth::estimator
