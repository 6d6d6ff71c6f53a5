// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/closest_point_grid.h"

#include <algorithm>
#include <cmath>

#include "common/core/mesh.h"
#include "common/core/ray_caster.h"

namespace berth::estimator {

namespace {

/// Equal to berth::nearest_on_triangle to the bit, without branches.
Four3 nearest_on_triangles(const Four3& p, const Four3& a, const Four3& b, const Four3& c) {
  const Four3 ab = b - a;
  const Four3 ac = c - a;
  const Four d1 = ab.dot(p - a);
  const Four d2 = ac.dot(p - a);
  const Four d3 = ab.dot(p - b);
  const Four d4 = ac.dot(p - b);
  const Four d5 = ab.dot(p - c);
  const Four d6 = ac.dot(p - c);
  const Four va = d3 * d6 - d5 * d4;
  const Four vb = d5 * d2 - d1 * d6;
  const Four vc = d1 * d4 - d3 * d2;
  // The first region that contains the query.
  const auto at_a = (d1 <= 0) & (d2 <= 0);
  const auto at_b = ~at_a & (d3 >= 0) & (d4 <= d3);
  const auto on_ab = ~(at_a | at_b) & (vc <= 0) & (d1 >= 0) & (d3 <= 0);
  const auto before_c = at_a | at_b | on_ab;
  const auto at_c = ~before_c & (d6 >= 0) & (d5 <= d6);
  const auto on_ac = ~(before_c | at_c) & (vb <= 0) & (d2 >= 0) & (d6 <= 0);
  const auto before_bc = before_c | at_c | on_ac;
  const auto on_bc = ~before_bc & (va <= 0) & (d4 - d3 >= 0) & (d5 - d6 >= 0);
  const auto inside = ~(before_bc | on_bc);
  const Four zero = four(0);
  const Four one = four(1);
  const Four above = on_ab ? d1 : on_ac ? d2 : on_bc ? d4 - d3 : one;
  const Four below = on_ab    ? d1 - d3
                     : on_ac  ? d2 - d6
                     : on_bc  ? (d4 - d3) + (d5 - d6)
                     : inside ? va + vb + vc
                              : one;
  const Four share = above / below;
  const Four along = inside ? vb * share : (on_ab | on_bc) ? share : zero;
  const Four aside = inside ? vc * share : on_ac ? share : zero;
  const Four3 from = chosen(at_b | on_bc, b, chosen(at_c, c, a));
  return from + along * chosen(on_bc, c - b, ab) + aside * ac;
}

}  // namespace

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

ClosestPointGrid::FourMatches ClosestPointGrid::refined(const Four3& queries,
                                                        const std::int64_t* voxels) const {
  const auto triangle = [&](int i) -> const Triangle& {
    return triangles_[nearest_[static_cast<std::size_t>(voxels[i])]];
  };
  const Triangle& t0 = triangle(0);
  const Triangle& t1 = triangle(1);
  const Triangle& t2 = triangle(2);
  const Triangle& t3 = triangle(3);
  const auto all = [&](const Eigen::Vector3f Triangle::*corner) {
    const auto axis = [&](Eigen::Index i) {
      return Four{double{(t0.*corner)[i]}, double{(t1.*corner)[i]}, double{(t2.*corner)[i]},
                  double{(t3.*corner)[i]}};
    };
    return Four3{axis(0), axis(1), axis(2)};
  };
  return {nearest_on_triangles(queries, all(&Triangle::a), all(&Triangle::b), all(&Triangle::c)),
          all(&Triangle::normal)};
}

}  // namespace berth::estimator
