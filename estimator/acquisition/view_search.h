// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/target_model.h"

namespace berth::estimator {

struct ViewSearchOptions {
  int turns = 24;          ///< in the image plane, for each view
  int first_points = 24;   ///< by which every view and turn is weighed
  int second_points = 96;  ///< by which the best of them are weighed again, and laid on
  int shortlist = 600;     ///< hypotheses weighed again
  int laid = 48;           ///< distinct ones of them that are laid on the surface
  int iterations = 6;
};

/// A pose that lays some points on the target's surface.
struct Candidate {
  Pose pose;        ///< T_sensor_model
  double cost = 0;  ///< mean distance of the points from the surface, cut off; m
};

/// Looks for poses in which the points lie on the target's surface: each view of the atlas at each
/// turn about the line of sight, its visible centroid laid on `centroid` plus each of the shifts;
/// the best are laid on the surface. points: sensor frame, as spread_points gives them. shifts: of
/// the centroid, in a frame whose z axis is the line of sight, m. Best first, distinct.
std::vector<Candidate> search_views(const TargetModel& model, const std::vector<Vector3d>& points,
                                    const Vector3d& centroid, const std::vector<Vector3d>& shifts,
                                    const ViewSearchOptions& options);

}  // namespace berth::estimator
