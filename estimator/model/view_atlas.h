// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "common/core/ray_caster.h"

namespace berth::estimator {

/// What the target looks like from one side: a viewer who comes nearer sees less of its flanks.
struct View {
  /// Radii of the target over the viewer's distance: from far away, and from nearer and nearer.
  static constexpr std::array<double, 4> nearness = {0.01, 0.2, 0.4, 0.6};

  Vector3d direction = Vector3d::UnitZ();  ///< unit, from the target to the viewer, model frame
  /// Of what beams spread evenly in angle would meet, for each nearness; model frame.
  std::array<Vector3d, nearness.size()> centroids;

  /// The centroid at any nearness.
  Vector3d centroid(double how_near) const;
};

/// Some rotation that carries `direction` (unit) to -z: from model axes to those of a viewer who
/// stands there and looks along +z.
Quaterniond towards_viewer(const Vector3d& direction);

/// Views spread evenly over the sphere, found by casting a raster of rays at the sphere (centre,
/// radius) that holds the mesh. The visible centroid of a view turns a hypothesis about attitude
/// and a cloud's centroid into a pose.
std::vector<View> make_view_atlas(const RayCaster& caster, const Vector3d& centre, double radius,
                                  int count);

}  // namespace berth::estimator
