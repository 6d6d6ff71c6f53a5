// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/closest_point_grid.h"

#include <algorithm>
#include <cmath>

#include "common/core/ray_caster.h"
#include "common/core/triangle.h"

namespace berth::estimator {

ClosestPointGrid::ClosestPointGrid(const Mesh& mesh, const std::vector<std::uint32_t>& triangles,
                                   double margin, int voxels) {
  Mesh seen;
  seen.vertices = mesh.vertices;
  for (const std::uint32_t t : triangles) {
    seen.triangles.push_back(mesh.triangles[t]);
    const Vector3d& a = mesh.vertices[mesh.triangles[t][0]];
    const Vector3d& b = mesh.vertices[mesh.triangles[t][1]];
    const Vector3d& c = mesh.vertices[mesh.triangles[t][2]];
    const Vector3d normal = (b - a).cross(c - a).normalized();
    triangles_.push_back({a.cast<float>(), b.cast<float>(), c.cast<float>(), normal.cast<float>()});
  }
  const Box box = bounding_box(mesh);
  low_ = box.low - Vector3d::Constant(margin);
  const Vector3d extent = box.size() + Vector3d::Constant(2 * margin);
  cell_ = std::cbrt(extent.prod() / voxels);
  for (std::size_t i = 0; i < 3; ++i) {
    size_[i] = static_cast<std::int64_t>(std::ceil(extent[static_cast<Eigen::Index>(i)] / cell_));
  }
  nearest_.resize(static_cast<std::size_t>(size_[0] * size_[1] * size_[2]));
  points_.resize(nearest_.size());
  const RayCaster caster(seen);
  std::size_t i = 0;
  for (std::int64_t z = 0; z < size_[2]; ++z) {
    for (std::int64_t y = 0; y < size_[1]; ++y) {
      for (std::int64_t x = 0; x < size_[0]; ++x, ++i) {
        points_[i] = caster.nearest(middle_of(x, y, z), &nearest_[i]).cast<float>();
      }
    }
  }
}

Vector3d ClosestPointGrid::middle_of(std::int64_t x, std::int64_t y, std::int64_t z) const {
  return low_ + cell_ * Vector3d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5,
                                 static_cast<double>(z) + 0.5);
}

double ClosestPointGrid::distance_at(std::int64_t x, std::int64_t y, std::int64_t z) const {
  const auto i = static_cast<std::size_t>(x + size_[0] * (y + size_[1] * z));
  return (points_[i].cast<double>() - middle_of(x, y, z)).norm();
}

bool ClosestPointGrid::stored(const Vector3d& query, Match& match) const {
  const std::int64_t i = index(query);
  if (i < 0) return false;
  const auto voxel = static_cast<std::size_t>(i);
  match.point = points_[voxel].cast<double>();
  match.normal = triangles_[nearest_[voxel]].normal.cast<double>();
  return true;
}

bool ClosestPointGrid::refined(const Vector3d& query, Match& match) const {
  const std::int64_t i = index(query);
  if (i < 0) return false;
  const Triangle& t = triangles_[nearest_[static_cast<std::size_t>(i)]];
  match.point =
      nearest_on_triangle(query, t.a.cast<double>(), t.b.cast<double>(), t.c.cast<double>());
  match.normal = t.normal.cast<double>();
  return true;
}

}  // namespace berth::estimator
