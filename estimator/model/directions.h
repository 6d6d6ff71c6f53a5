// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// Unit vectors spread evenly over the sphere (Fibonacci lattice).
std::vector<Vector3d> spread_directions(int count);

/// View directions spread evenly over the sphere (Fibonacci lattice); about 18 degrees apart.
constexpr int direction_count = 128;

/// From which of the directions something is seen; direction i points from the thing to the viewer.
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

}  // namespace berth::estimator
