// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/mesh_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/core/error.h"

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
    // Corners that touch an ear block it, unless no other ear is left: then they may be the ends of
    // an edge that is passed twice.
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

  /// Fan of triangles from the first corner, where it covers the polygon: convex, or with a single
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

constexpr std::uint32_t not_yet = std::numeric_limits<std::uint32_t>::max();

bool without_area(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double edge =
      std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
  return (b - a).cross(c - a).norm() <= 1e-9 * edge;
}

}  // namespace

bool triangulate(std::span<const Vector3d> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  // Corners that repeat the previous one are dropped.
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

std::size_t MeshBuilder::PlaceHash::operator()(const std::array<double, 3>& place) const {
  std::uint64_t hash = 0;
  for (const double v : place) {  // as in MurmurHash3's finaliser
    hash = (hash ^ std::bit_cast<std::uint64_t>(v)) * 0xff51afd7ed558ccdULL;
    hash ^= hash >> 33;
  }
  return hash;
}

std::string MeshBuilder::add_vertex(const Vector3d& vertex) {
  // areas and volumes must be numbers too
  constexpr double too_far = 1e100;
  if (!vertex.allFinite()) return "a coordinate is not finite";
  if (vertex.cwiseAbs().maxCoeff() > too_far) return "a coordinate is beyond 1e100";
  if (file_vertices_.size() == not_yet) return "more vertices than 32 bits can number";
  file_vertices_.push_back(vertex);
  welded_.push_back(not_yet);
  return {};
}

void MeshBuilder::set_groups(const std::vector<std::string>& names) {
  groups_.clear();
  for (const std::string& name : names) {
    const auto [place, fresh] = group_index_.try_emplace(name, mesh_.groups.size());
    if (fresh) mesh_.groups.push_back({name, {}});
    if (std::find(groups_.begin(), groups_.end(), place->second) == groups_.end()) {
      groups_.push_back(place->second);
    }
  }
}

std::string MeshBuilder::add_face(std::span<const std::uint32_t> corners) {
  if (corners.empty()) return "a face without corners";
  bool any = false;
  if (corners.size() == 3) {
    any = add_triangle(corners[0], corners[1], corners[2]);
  } else {
    polygon_.clear();
    for (const std::uint32_t corner : corners) polygon_.push_back(file_vertices_[corner]);
    pieces_.clear();
    if (!triangulate(polygon_, pieces_)) {
      return "a face of " + std::to_string(corners.size()) +
             " corners crosses itself, expected an outline that does not (or triangles)";
    }
    for (const auto& piece : pieces_) {
      any |= add_triangle(corners[piece[0]], corners[piece[1]], corners[piece[2]]);
    }
  }
  if (!any) ++mesh_.faces_without_area;
  return {};
}

std::uint32_t MeshBuilder::welded(std::uint32_t file_vertex) {
  if (keeps_numbering_) return file_vertex;
  std::uint32_t& known = welded_[file_vertex];
  if (known != not_yet) return known;
  const Vector3d& v = file_vertices_[file_vertex];
  const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
  // -0 and 0 are one place
  const auto [place, fresh] = index_.try_emplace({v.x() + 0.0, v.y() + 0.0, v.z() + 0.0}, next);
  if (fresh) mesh_.vertices.push_back(v);
  return known = place->second;
}

bool MeshBuilder::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (without_area(file_vertices_[a], file_vertices_[b], file_vertices_[c])) return false;
  const auto index = static_cast<std::uint32_t>(mesh_.triangles.size());
  for (const std::size_t group : groups_) mesh_.groups[group].triangles.push_back(index);
  // one after the other: the order of the vertices is part of the content
  const std::uint32_t first = welded(a);
  const std::uint32_t second = welded(b);
  mesh_.triangles.push_back({first, second, welded(c)});
  return true;
}

Mesh MeshBuilder::take(const std::string& file) {
  if (mesh_.triangles.empty()) {
    throw InputError(file + ": holds no triangle" +
                     (mesh_.faces_without_area > 0
                          ? ": " + std::to_string(mesh_.faces_without_area) + " faces without area"
                          : ""));
  }
  if (keeps_numbering_) mesh_.vertices = std::move(file_vertices_);
  std::erase_if(mesh_.groups, [](const MeshGroup& group) { return group.triangles.empty(); });
  return std::move(mesh_);
}

}  // namespace berth
