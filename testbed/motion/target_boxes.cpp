// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/target_boxes.h"

#include <limits>

namespace berth::testbed {
namespace {

/// The part of a polygon on one side of a plane across an axis: sign * (p[axis] - at) >= 0.
std::vector<Vector3d> clipped(const std::vector<Vector3d>& polygon, int axis, double at,
                              double sign) {
  std::vector<Vector3d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d& a = polygon[i];
    const Vector3d& b = polygon[(i + 1) % polygon.size()];
    const double side_a = sign * (a[axis] - at);
    const double side_b = sign * (b[axis] - at);
    if (side_a >= 0) kept.push_back(a);
    if ((side_a > 0 && side_b < 0) || (side_a < 0 && side_b > 0)) {
      kept.push_back(a + (b - a) * (side_a / (side_a - side_b)));
    }
  }
  return kept;
}

}  // namespace

std::vector<Box> cover_with_boxes(const Mesh& mesh, int slices) {
  const Box bounds = bounding_box(mesh);
  int axis = 0;
  bounds.size().maxCoeff(&axis);
  const double width = bounds.size()[axis] / slices;
  std::vector<Box> boxes;
  for (int slice = 0; slice < slices; ++slice) {
    const double low = bounds.low[axis] + slice * width;
    const double high = low + width;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Box box{Vector3d::Constant(infinity), Vector3d::Constant(-infinity)};
    for (const auto& triangle : mesh.triangles) {
      std::vector<Vector3d> polygon;
      polygon.reserve(triangle.size());
      for (const std::uint32_t vertex : triangle) polygon.push_back(mesh.vertices[vertex]);
      double least = infinity;
      double most = -infinity;
      for (const Vector3d& vertex : polygon) {
        least = std::min(least, vertex[axis]);
        most = std::max(most, vertex[axis]);
      }
      if (most < low || least > high) continue;
      if (least < low) polygon = clipped(polygon, axis, low, 1);
      if (most > high) polygon = clipped(polygon, axis, high, -1);
      for (const Vector3d& vertex : polygon) {
        box.low = box.low.cwiseMin(vertex);
        box.high = box.high.cwiseMax(vertex);
      }
    }
    if (box.low.x() <= box.high.x()) boxes.push_back(box);
  }
  return boxes;
}

}  // namespace berth::testbed
