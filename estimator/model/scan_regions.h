// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/model/visible_surface.h"

namespace berth::estimator {

/// A region of the surface worth scanning, chosen when the model is compiled.
struct ScanRegion {
  enum class Kind : std::uint32_t { corner, edge, surface };
  Kind kind = Kind::surface;
  Eigen::Vector3f position;   ///< a point of the visible surface, model frame, m
  Eigen::Vector3f normal;     ///< unit
  float radius = 0;           ///< m
  DirectionSet visible_from;  ///< directions from which a third of its samples is visible
};

/// Corners, edges and an even cover of the surface, from visible samples alone. The offset of a
/// neighbourhood's centroid from its middle classifies a sample: about 0 inside a face, larger at
/// an edge, largest at a corner. radius: of a corner or edge region, m; enlarged where samples are
/// sparse.
std::vector<ScanRegion> find_scan_regions(const std::vector<SurfaceSample>& samples, double radius);

}  // namespace berth::estimator
