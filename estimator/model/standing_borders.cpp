// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/standing_borders.h"

#include <algorithm>
#include <array>
#include <utility>

namespace berth::estimator {

namespace {

constexpr double least_m = 0.004;  // nearer before, none does
constexpr double most_m = 0.1;     // farther before, every range tells
/// Beams come at most so flat (tangent): it hides what lies so many heights beside it.
constexpr double slope = 2;
/// Facets of finer meshes end nearly everywhere: little is left to be mistaken.
constexpr std::size_t most_triangles = 4000;

/// A triangle in its own plane: axes along its longest side, across it, and its normal.
struct Frame {
  Matrix3d axes;
  Vector3d origin;
  Eigen::Vector2d low, high;

  Frame(const Vector3d& a, const Vector3d& b, const Vector3d& c) : origin(a) {
    const std::array<Vector3d, 3> sides{b - a, c - b, a - c};
    const auto longest = std::max_element(
        sides.begin(), sides.end(),
        [](const Vector3d& p, const Vector3d& q) { return p.squaredNorm() < q.squaredNorm(); });
    const Vector3d normal = sides[0].cross(sides[1]).normalized();
    axes << longest->normalized(), normal.cross(longest->normalized()), normal;
    low = high = Eigen::Vector2d::Zero();
    for (const Vector3d& corner : {b, c}) {
      const Eigen::Vector2d at = (axes.transpose() * (corner - a)).head<2>();
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
  }
};

/// Whether an end stands before it, on its normal's side (1) or the other (-1).
bool stands_before(const Frame& frame, const FaceBorders::End& end, double side) {
  const double height_from = side * frame.axes.col(2).dot(end.from - frame.origin);
  const double height_to = side * frame.axes.col(2).dot(end.to - frame.origin);
  if (!(std::max(height_from, height_to) > least_m && std::min(height_from, height_to) < most_m)) {
    return false;
  }
  const auto in_frame = [&](const Vector3d& point, double height) {
    const Eigen::Vector2d at = frame.axes.leftCols<2>().transpose() * (point - frame.origin);
    return Vector3d(at.x(), at.y(), height);
  };
  Vector3d from = in_frame(end.from, height_from);
  Vector3d to = in_frame(end.to, height_to);
  if (from.z() > to.z()) std::swap(from, to);
  // The part of it that stands neither behind nor too far before.
  const Vector3d along = to - from;
  const auto at = [&](double height) {
    return Vector3d(from + (height - from.z()) / along.z() * along);
  };
  const Vector3d low = from.z() < 0 ? at(0) : from;
  const Vector3d high = to.z() > most_m ? at(most_m) : to;
  const double shadow = slope * high.z();
  const Eigen::Vector2d least = low.cwiseMin(high).head<2>().array() - shadow;
  const Eigen::Vector2d most = low.cwiseMax(high).head<2>().array() + shadow;
  return (least.array() < frame.high.array()).all() && (most.array() > frame.low.array()).all();
}

}  // namespace

StandingBorders::StandingBorders(const Mesh& mesh, const std::vector<FaceBorders::End>& ends) {
  first_.assign(1, 0);
  if (mesh.triangles.size() > most_triangles) return;
  first_.reserve(2 * mesh.triangles.size() + 1);
  for (const auto& corners : mesh.triangles) {
    const Frame frame(mesh.vertices[corners[0]], mesh.vertices[corners[1]],
                      mesh.vertices[corners[2]]);
    for (const double side : {1.0, -1.0}) {
      for (std::uint32_t i = 0; i < ends.size(); ++i) {
        if (stands_before(frame, ends[i], side)) ends_.push_back(i);
      }
      first_.push_back(static_cast<std::uint32_t>(ends_.size()));
    }
  }
}

StandingBorders::Both StandingBorders::before(std::uint32_t triangle) const {
  const std::size_t at = 2 * static_cast<std::size_t>(triangle);
  if (at + 2 >= first_.size()) return {};
  const std::span all(ends_);
  return {all.subspan(first_[at], first_[at + 1] - first_[at]),
          all.subspan(first_[at + 1], first_[at + 2] - first_[at + 1])};
}

}  // namespace berth::estimator
