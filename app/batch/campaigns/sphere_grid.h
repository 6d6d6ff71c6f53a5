// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "common/core/pose.h"

namespace berth::campaigns {

/// The sphere cut into cells of exactly equal area, nearly square but at the poles: rings of equal
/// cells, as many in a ring as its length asks for (after Malkin, "A new method to subdivide a
/// spherical surface into equal-area cells", 2016).
class SphereGrid {
 public:
  /// @param wanted number of cells, at least 1; as near as the rings allow
  explicit SphereGrid(std::size_t wanted);

  /// Longitude from -pi to pi about z, from x; latitude, rad.
  struct Cell {
    double west;
    double east;
    double south;
    double north;
  };

  std::size_t size() const { return cells_.size(); }
  const Cell& cell(std::size_t index) const { return cells_[index]; }
  /// Of a direction of any length but zero.
  std::size_t cell_at(const Vector3d& direction) const;

 private:
  struct Ring {
    double south_z;  ///< sine of its southern latitude
    std::size_t first;
    std::size_t count;
  };
  std::vector<Ring> rings_;  ///< from north to south
  std::vector<Cell> cells_;
};

}  // namespace berth::campaigns
