// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/ray_caster.h"

namespace berth::estimator {

/// The visible surface of the target from one direction. Viewer's axes (z along the line of sight),
/// about the centre of the target's sphere, m.
struct ViewTemplate {
  static constexpr int anchors = 2;  ///< the first of the points
  static constexpr int surface_points = 48;
  static constexpr int outside_points = 20;

  Quaterniond view;  ///< from model axes to the viewer's
  /// On the surface, away from its outline, in the order of farthest point sampling. A row each.
  Eigen::Array<float, surface_points, 3> points;
  /// Just outside the outline, at the depth of the nearest surface.
  Eigen::Array<float, Eigen::Dynamic, 3, 0, outside_points, 3> outside;
  double area = 0;       ///< m^2, of the outline
  double perimeter = 0;  ///< m
};

/// Views from directions spread over the sphere, at a distance of five radii. @param radius of the
/// sphere about `centre` that holds the target, m
std::vector<ViewTemplate> make_view_templates(const RayCaster& caster, const Vector3d& centre,
                                              double radius, int count);

}  // namespace berth::estimator
