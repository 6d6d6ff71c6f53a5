// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/cell.h"

namespace berth {

/// What is drawn in addition to the cell itself.
struct CellPicture {
  Joints replica{};
  Joints sensor{};
  std::vector<Vector3d> returns;  ///< of the LIDAR, sensor frame
  Vector3d eye{3.2, -7.5, 4.6};   ///< cell frame
  Vector3d look_at{3.0, 0.4, 1.35};
  std::string caption;
};

/// The cell with both arms, target, sensor and LIDAR returns as an SVG, in perspective. Walls are
/// left out. Triangles are sorted by depth: good enough to look at, not a renderer.
std::string draw(const Cell& cell, const CellPicture& picture);

}  // namespace berth
