// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/polygon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace berth {
namespace {

using Point = Eigen::Vector2d;
using Ring = std::vector<std::uint32_t>;

/// Twice the area of abc; positive when it turns to the left.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

class EarClipping {
 public:
  /// points: of an outline that turns to the left.
  EarClipping(const std::vector<Point>& points, double no_area)
      : points_(points), no_area_(no_area) {}

  bool clip(Ring ring, std::vector<std::array<std::uint32_t, 3>>& triangles) const {
    start_at_concave(ring);
    if (fan(ring, triangles)) return true;
    if (crosses_itself(ring)) return false;
    // Corners that touch an ear are in its way, unless nothing else is left: then they may be the
    // ends of an edge that is passed twice.
    std::size_t at = 1;
    std::size_t failed = 0;
    bool touching = false;
    while (ring.size() >= 3) {
      if (failed == ring.size()) {
        if (touching) return std::abs(area(ring)) <= no_area_;
        touching = true;
        failed = 0;
      }
      at %= ring.size();
      const std::size_t before = (at + ring.size() - 1) % ring.size();
      const std::size_t after = (at + 1) % ring.size();
      if (!is_ear(ring, before, at, after, touching)) {
        ++at;
        ++failed;
        continue;
      }
      triangles.push_back({ring[before], ring[at], ring[after]});
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(at));
      failed = 0;
      touching = false;
    }
    return true;
  }

 private:
  double turn_at(const Ring& ring, std::size_t i) const {
    const std::size_t n = ring.size();
    return turn(points_[ring[(i + n - 1) % n]], points_[ring[i]], points_[ring[(i + 1) % n]]);
  }

  void start_at_concave(Ring& ring) const {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      if (turn_at(ring, i) < -no_area_) {
        std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(i), ring.end());
        return;
      }
    }
  }

  /// All corners joined with the first, where that is right: a convex polygon, or one with a single
  /// concave corner.
  bool fan(const Ring& ring, std::vector<std::array<std::uint32_t, 3>>& triangles) const {
    for (std::size_t i = 1; i < ring.size(); ++i) {
      if (turn_at(ring, i) <= 0) return false;
    }
    const bool convex = turn_at(ring, 0) > 0;
    double angle = 0;
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
      const Point to = points_[ring[i]] - points_[ring[0]];
      const Point next = points_[ring[i + 1]] - points_[ring[0]];
      const double area = to.x() * next.y() - to.y() * next.x();
      if (area <= 0) return false;
      angle += std::atan2(area, to.dot(next));
    }
    if (angle > (convex ? 1 : 2) * std::numbers::pi) return false;
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
      triangles.push_back({ring[0], ring[i], ring[i + 1]});
    }
    return true;
  }

  /// Whether a and b are on different sides of the line through c and d.
  bool parted(const Point& a, const Point& b, const Point& c, const Point& d) const {
    const double of_a = turn(c, d, a);
    const double of_b = turn(c, d, b);
    return std::min(of_a, of_b) < -no_area_ && std::max(of_a, of_b) > no_area_;
  }

  bool crosses_itself(const Ring& ring) const {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Point& a = points_[ring[i]];
      const Point& b = points_[ring[(i + 1) % ring.size()]];
      for (std::size_t k = i + 2; k < ring.size(); ++k) {
        const Point& c = points_[ring[k]];
        const Point& d = points_[ring[(k + 1) % ring.size()]];
        if (parted(a, b, c, d) && parted(c, d, a, b)) return true;
      }
    }
    return false;
  }

  double area(const Ring& ring) const {
    double sum = 0;
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
      sum += turn(points_[ring[0]], points_[ring[i]], points_[ring[i + 1]]);
    }
    return sum;
  }

  bool is_ear(const Ring& ring, std::size_t before, std::size_t at, std::size_t after,
              bool touching) const {
    const Point& a = points_[ring[before]];
    const Point& b = points_[ring[at]];
    const Point& c = points_[ring[after]];
    if (turn(a, b, c) <= 0) return false;
    return std::none_of(ring.begin(), ring.end(), [&](std::uint32_t corner) {
      const Point& p = points_[corner];
      if (p == a || p == b || p == c) return false;
      const double inside = std::min({turn(a, b, p), turn(b, c, p), turn(c, a, p)});
      return touching ? inside > 0 : inside >= 0;
    });
  }

  const std::vector<Point>& points_;
  double no_area_;
};

}  // namespace

bool triangulate(std::span<const Vector3d> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  // Corners that repeat the one before say nothing.
  Ring ring;
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    if (ring.empty() || corners[i] != corners[ring.back()]) ring.push_back(i);
  }
  while (ring.size() > 1 && corners[ring.back()] == corners[ring.front()]) ring.pop_back();
  if (ring.size() < 3) return true;

  const Vector3d& origin = corners[ring[0]];
  Vector3d normal = Vector3d::Zero();
  Vector3d farthest = Vector3d::Zero();
  for (std::size_t i = 1; i < ring.size(); ++i) {
    const Vector3d to = corners[ring[i]] - origin;
    if (i + 1 < ring.size()) normal += to.cross(corners[ring[i + 1]] - origin);
    if (to.squaredNorm() > farthest.squaredNorm()) farthest = to;
  }
  const double no_area = 1e-9 * farthest.squaredNorm();
  if (normal.norm() <= no_area) {
    return std::all_of(ring.begin(), ring.end(), [&](std::uint32_t i) {
      return farthest.cross(corners[i] - origin).norm() <= no_area;
    });
  }

  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const Eigen::Index u = (axis + (normal[axis] > 0 ? 1 : 2)) % 3;
  const Eigen::Index v = (axis + (normal[axis] > 0 ? 2 : 1)) % 3;
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const Vector3d& corner : corners)
    points.emplace_back((corner - origin)[u], (corner - origin)[v]);
  return EarClipping(points, no_area).clip(std::move(ring), triangles);
}

}  // namespace berth
