// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/model/visible_surface.h"

namespace berth::estimator {

/// A piece of the surface worth scanning, chosen when the model is compiled.
struct ScanRegion {
  enum class Kind : std::uint32_t { corner, edge, surface };
  Kind kind = Kind::surface;
  Eigen::Vector3f position;   ///< a point of the visible surface, model frame, m
  Eigen::Vector3f normal;     ///< unit
  float radius = 0;           ///< m
  DirectionSet visible_from;  ///< directions from which half of it is seen
};

/// Finds corners, edges and an even cover of the surface from visible samples alone: at an edge the
/// neighbourhood's centroid stands off to one side, at a corner more so; inside a surface it does
/// not. radius: of a corner or edge region, m; larger where the samples are too sparse for it.
std::vector<ScanRegion> find_scan_regions(const std::vector<SurfaceSample>& samples, double radius);

}  // namespace berth::estimator
