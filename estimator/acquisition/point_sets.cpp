// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/point_sets.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace berth::estimator {

namespace {

constexpr std::size_t least_points = 12;

/// Groups of points connected through neighbouring cells, largest first.
std::vector<std::vector<Vector3d>> clusters(const std::vector<Vector3d>& points, double cell) {
  using Key = std::tuple<int, int, int>;
  std::map<Key, std::vector<std::uint32_t>> cells;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d c = points[i] / cell;
    cells[{static_cast<int>(std::floor(c.x())), static_cast<int>(std::floor(c.y())),
           static_cast<int>(std::floor(c.z()))}]
        .push_back(static_cast<std::uint32_t>(i));
  }
  std::vector<std::vector<Vector3d>> result;
  while (!cells.empty()) {
    std::vector<Key> open = {cells.begin()->first};
    std::vector<Vector3d> group;
    while (!open.empty()) {
      const Key key = open.back();
      open.pop_back();
      const auto found = cells.find(key);
      if (found == cells.end()) continue;
      for (const std::uint32_t i : found->second) group.push_back(points[i]);
      cells.erase(found);
      const auto [x, y, z] = key;
      for (int n = 0; n < 27; ++n)
        open.push_back({x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1});
    }
    result.push_back(std::move(group));
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return result;
}

/// Keeps what lies within the target's length and width about the set's own axis.
PointSet trimmed(const PointSet& set, const TargetSize& size) {
  constexpr double slack = 1.15;
  PointSet result = set;
  for (int round = 0; round < 3; ++round) {
    std::vector<Vector3d> kept;
    for (const Vector3d& p : set.points) {
      const Vector3d d = p - result.centroid;
      const double along = d.dot(result.axis);
      const double across = (d - along * result.axis).norm();
      if (std::abs(along) <= slack * size.half_length && across <= slack * size.radius) {
        kept.push_back(p);
      }
    }
    if (kept.size() < least_points || kept.size() == result.points.size()) break;
    result.points = std::move(kept);
    find_axes(result);
  }
  return result;
}

bool says_the_same(const PointSet& a, const PointSet& b, const TargetSize& size) {
  return std::abs(a.axis.dot(b.axis)) > std::cos(radians(2)) &&
         (a.centroid - b.centroid).norm() < 0.04 * size.half_length;
}

}  // namespace

void find_axes(PointSet& set) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : set.points) sum += p;
  const double count = std::max<double>(1, static_cast<double>(set.points.size()));
  set.centroid = sum / count;
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& p : set.points) {
    scatter += (p - set.centroid) * (p - set.centroid).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter / count);
  set.axis = eigen.eigenvectors().col(2);
  set.second = eigen.eigenvectors().col(1);
  const Vector3d spread = eigen.eigenvalues().cwiseMax(1e-12).cwiseSqrt();
  set.elongation = spread[2] / spread[1];
}

std::vector<PointSet> candidate_point_sets(const std::vector<Vector3d>& points,
                                           const TargetSize& size, std::size_t at_most) {
  // Depths behind the nearest returns, in lengths of the target: seen square, aslant, end on.
  constexpr double slice_depths[] = {0.15, 0.35, 0.7, 1.1};
  constexpr std::size_t clusters_per_slice = 2;
  const double length = 2 * size.half_length;

  std::vector<PointSet> result;
  const auto add = [&](const PointSet& set) {
    if (set.points.size() < least_points || result.size() >= at_most) return;
    for (const PointSet& other : result) {
      if (says_the_same(set, other, size)) return;
    }
    result.push_back(set);
  };
  const auto add_with_trimmed = [&](std::vector<Vector3d> members) {
    if (members.size() < least_points) return;
    PointSet set;
    set.points = std::move(members);
    find_axes(set);
    add(trimmed(set, size));
    add(set);
  };

  std::vector<double> ranges;
  ranges.reserve(points.size());
  for (const Vector3d& p : points) ranges.push_back(p.norm());
  std::vector<double> sorted = ranges;
  std::sort(sorted.begin(), sorted.end());
  if (sorted.size() < least_points) return result;
  // A hundredth of the returns may be stray ones in front.
  const double nearest = sorted[sorted.size() / 100];
  std::size_t last_size = 0;
  for (const double depth : slice_depths) {
    std::vector<Vector3d> slice;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (ranges[i] >= nearest - 0.02 * length && ranges[i] <= nearest + depth * length) {
        slice.push_back(points[i]);
      }
    }
    if (slice.size() == last_size) continue;
    last_size = slice.size();
    auto groups = clusters(slice, 0.06 * length);
    for (std::size_t g = 0; g < std::min(groups.size(), clusters_per_slice); ++g) {
      add_with_trimmed(groups[g]);
    }
    add_with_trimmed(std::move(slice));
  }
  auto groups = clusters(points, 0.06 * length);
  for (std::size_t g = 0; g < std::min(groups.size(), clusters_per_slice); ++g) {
    add_with_trimmed(groups[g]);
  }
  add_with_trimmed(points);
  return result;
}

}  // namespace berth::estimator
