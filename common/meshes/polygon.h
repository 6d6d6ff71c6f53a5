// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/pose.h"

namespace berth {

/// Cuts a polygon, convex or not, into triangles of the polygon's winding by clipping ears
/// (Meisters, "Polygons have ears", 1975), seen along its mean normal (Newell). Corners of a convex
/// one are joined with its first, of one with a single concave corner with that one. Holes may be
/// joined to the outline by an edge that is passed twice. Time grows with the square of the corners
/// where it is concave.
/// @param triangles indices of corners are added; none for a polygon without area.
/// @return false when it crosses itself.
bool triangulate(std::span<const Vector3d> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace berth
