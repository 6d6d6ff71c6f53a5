// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/core/mesh.h"
#include "common/core/pose.h"
#include "common/core/ray_caster.h"

namespace berth::estimator {

/// Unit vectors spread evenly over the sphere (Fibonacci lattice).
std::vector<Vector3d> spread_directions(int count);

/// View directions on a Fibonacci lattice, about 18 degrees apart.
constexpr int direction_count = 128;

/// A set of the view directions; direction i points from the surface to the viewer.
struct DirectionSet {
  std::array<std::uint64_t, 2> bits{};

  void insert(int i) { bits[static_cast<std::size_t>(i >> 6)] |= std::uint64_t{1} << (i & 63); }
  bool contains(int i) const { return (bits[static_cast<std::size_t>(i >> 6)] >> (i & 63)) & 1; }
  int size() const { return __builtin_popcountll(bits[0]) + __builtin_popcountll(bits[1]); }
};

/// Unit vectors, model frame.
const std::array<Vector3d, direction_count>& view_directions();
/// Index of the nearest of them to a direction of any length.
int nearest_direction(const Vector3d& direction);

/// A point of the surface that is visible from outside.
struct SurfaceSample {
  Eigen::Vector3f position;  ///< m, model frame
  Eigen::Vector3f normal;    ///< unit, towards the side from which it is visible more
  std::uint32_t triangle = 0;
  DirectionSet visible_from;
};

struct VisibleSurface {
  std::vector<SurfaceSample> samples;    ///< uniform over the visible area
  std::vector<std::uint32_t> triangles;  ///< indices of visible triangles, ascending
};

/// The visible surface of a mesh, by casting rays to distant viewpoints: winding, closedness and
/// interior walls do not matter. Deterministic. About `count` candidate points over the whole area.
VisibleSurface find_visible_surface(const Mesh& mesh, const RayCaster& caster, int count);

}  // namespace berth::estimator
