// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/face_borders.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace berth::estimator {

namespace {

/// One side of a triangle, named by its end points, equal points having equal numbers.
struct Half {
  std::uint32_t low, high, triangle, side;
};

/// Meshes repeat vertices: the same number for the same place.
std::vector<std::uint32_t> places(const std::vector<Vector3d>& vertices) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto less = [&](std::uint32_t a, std::uint32_t b) {
    return std::lexicographical_compare(vertices[a].data(), vertices[a].data() + 3,
                                        vertices[b].data(), vertices[b].data() + 3);
  };
  std::sort(order.begin(), order.end(), less);
  std::vector<std::uint32_t> place(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool repeated = i > 0 && !less(order[i - 1], order[i]);
    place[order[i]] = repeated ? place[order[i - 1]] : order[i];
  }
  return place;
}

}  // namespace

FaceBorders::FaceBorders(const Mesh& mesh) : sides_(mesh.triangles.size()) {
  constexpr double flat = 0.9999;  // cosine between normals of one face
  const std::vector<std::uint32_t> place = places(mesh.vertices);
  std::vector<Half> halves;
  std::vector<Vector3d> normals;
  halves.reserve(3 * mesh.triangles.size());
  normals.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    const Vector3d& origin = mesh.vertices[corners[0]];
    normals.push_back((mesh.vertices[corners[1]] - origin)
                          .cross(mesh.vertices[corners[2]] - origin)
                          .normalized());
    for (std::uint32_t side = 0; side < 3; ++side) {
      const Vector3d& a = mesh.vertices[corners[side]];
      const Vector3d& b = mesh.vertices[corners[(side + 1) % 3]];
      const Vector3d& opposite = mesh.vertices[corners[(side + 2) % 3]];
      const Vector3d along = (b - a).normalized();
      const Vector3d inward = (opposite - a) - along * along.dot(opposite - a);
      if (!(inward.norm() > 0)) continue;
      const double offset = inward.normalized().dot(a);
      sides_[t][side] = {inward.normalized(), offset, offset};
      const auto [low, high] = std::minmax(place[corners[side]], place[corners[(side + 1) % 3]]);
      halves.push_back({low, high, t, side});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return std::tie(a.low, a.high, a.triangle, a.side) <
           std::tie(b.low, b.high, b.triangle, b.side);
  });
  for (std::size_t first = 0; first < halves.size();) {
    std::size_t last = first;
    while (last < halves.size() && halves[last].low == halves[first].low &&
           halves[last].high == halves[first].high) {
      ++last;
    }
    // A side is no border where a triangle of the same plane lies beyond it.
    std::vector<const Half*> inner;
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t j = first; j < last; ++j) {
        const Half& a = halves[i];
        const Half& b = halves[j];
        if (std::abs(normals[a.triangle].dot(normals[b.triangle])) > flat &&
            sides_[a.triangle][a.side].inward.dot(sides_[b.triangle][b.side].inward) < 0) {
          inner.push_back(&a);
          break;
        }
      }
    }
    if (inner.size() < last - first) {
      const auto& corners = mesh.triangles[halves[first].triangle];
      const std::uint32_t side = halves[first].side;
      ends_.push_back({mesh.vertices[corners[side]], mesh.vertices[corners[(side + 1) % 3]]});
    }
    for (const Half* half : inner) sides_[half->triangle][half->side].end = endless;
    first = last;
  }
}

}  // namespace berth::estimator
