// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "common/core/mesh.h"
#include "estimator/model/lanes.h"

namespace berth::estimator {

/// Where the flat faces of a mesh end: at open edges and at creases, not where one triangle goes on
/// in the next. Model frame, m.
class FaceBorders {
 public:
  explicit FaceBorders(const Mesh& mesh);

  /// Whether a point of a triangle is nearer than this to an end of its face, as far as the
  /// triangle's own sides tell.
  bool near(std::uint32_t triangle, const Vector3d& point, double distance) const {
    const auto& sides = sides_[triangle];
    return sides[0].inward.dot(point) < sides[0].end + distance ||
           sides[1].inward.dot(point) < sides[1].end + distance ||
           sides[2].inward.dot(point) < sides[2].end + distance;
  }
  /// Which of four points of a triangle's plane are within it, as far as this each from its sides:
  /// so far from the ends of the face, too, of those that other triangles have.
  FourFlags within(std::uint32_t triangle, const Four3& points, const Four& distance) const {
    const auto inside = [&](const Side& side) {
      return four(side.inward).dot(points) >= side.offset + distance;
    };
    const auto& sides = sides_[triangle];
    return inside(sides[0]) & inside(sides[1]) & inside(sides[2]);
  }

  /// One side of a face, once for all triangles that share it.
  struct End {
    Vector3d from, to;
  };
  const std::vector<End>& ends() const { return ends_; }

 private:
  /// Depth inside a side: inward.point - offset.
  struct Side {
    Vector3d inward = Vector3d::Zero();
    double offset = 0;
    double end = endless;  ///< the offset where the face ends there
  };
  static constexpr double endless = -1e30;
  std::vector<std::array<Side, 3>> sides_;
  std::vector<End> ends_;
};

}  // namespace berth::estimator
