// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/mesh.h"
#include "common/core/ray_caster.h"
#include "estimator/model/directions.h"

namespace berth::estimator {

/// A point of the surface that can be seen from outside.
struct SurfaceSample {
  Eigen::Vector3f position;  ///< m, model frame
  Eigen::Vector3f normal;    ///< unit, towards the side from which it is seen more
  std::uint32_t triangle = 0;
  DirectionSet visible_from;
};

struct VisibleSurface {
  std::vector<SurfaceSample> samples;    ///< uniform over the visible area
  std::vector<std::uint32_t> triangles;  ///< indices of those that are seen, ascending
};

/// Finds what can be seen of a mesh by casting rays to far viewpoints: winding, closedness and
/// inner walls do not matter. Deterministic. About `count` candidate points over the whole area.
VisibleSurface find_visible_surface(const Mesh& mesh, const RayCaster& caster, int count);

}  // namespace berth::estimator
