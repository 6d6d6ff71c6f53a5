// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/point_sets.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <unordered_map>

namespace berth::estimator {

namespace {

constexpr std::size_t min_points = 12;

/// A sparse grid: points by cell.
class Cells {
 public:
  static constexpr std::uint32_t none = ~0U;

  Cells(const std::vector<Vector3d>& points, double size) : of_point_(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector3d c = points[i] / size;
      of_point_[i] = cell(key(static_cast<std::int64_t>(std::floor(c.x())),
                              static_cast<std::int64_t>(std::floor(c.y())),
                              static_cast<std::int64_t>(std::floor(c.z()))));
    }
    // The points of one cell side by side.
    first_.assign(keys_.size() + 1, 0);
    for (const std::uint32_t c : of_point_) ++first_[c + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    points_.resize(points.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      points_[next[of_point_[i]]++] = static_cast<std::uint32_t>(i);
    }
  }

  /// In the order of their positions.
  std::vector<std::uint32_t> sorted() const {
    std::vector<std::uint32_t> order(keys_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return keys_[a] < keys_[b]; });
    return order;
  }
  std::span<const std::uint32_t> points(std::uint32_t cell) const {
    return std::span(points_).subspan(first_[cell], first_[cell + 1] - first_[cell]);
  }
  /// The n-th of 27 neighbours, itself included; none where there are no points.
  std::uint32_t neighbour(std::uint32_t cell, int n) const {
    const auto found =
        numbers_.find(keys_[cell] + key(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1) - key(0, 0, 0));
    return found == numbers_.end() ? none : found->second;
  }

 private:
  /// Ordered as x, y, z; for places within a million cells.
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t middle = 1 << 20;
    const auto bits = [](std::int64_t v) { return static_cast<std::uint64_t>(v + middle); };
    return (bits(x) << 42) + (bits(y) << 21) + bits(z);
  }
  /// Caches the last cell: consecutive points are mostly in the same one.
  std::uint32_t cell(std::uint64_t key) {
    if (last_ == none || keys_[last_] != key) {
      const auto [place, is_new] =
          numbers_.try_emplace(key, static_cast<std::uint32_t>(keys_.size()));
      if (is_new) keys_.push_back(key);
      last_ = place->second;
    }
    return last_;
  }

  std::vector<std::uint32_t> of_point_, first_, points_;
  std::vector<std::uint64_t> keys_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;  // of the cells, by key
  std::uint32_t last_ = none;
};

/// Groups of points connected through neighbouring cells, largest first.
std::vector<std::vector<Vector3d>> clusters(const std::vector<Vector3d>& points, double cell) {
  const Cells cells(points, cell);
  const std::vector<std::uint32_t> order = cells.sorted();
  std::vector<bool> visited(order.size());
  std::vector<std::vector<Vector3d>> result;
  for (const std::uint32_t start : order) {
    if (visited[start]) continue;
    std::vector<std::uint32_t> open = {start};
    std::vector<Vector3d> group;
    while (!open.empty()) {
      const std::uint32_t here = open.back();
      open.pop_back();
      if (visited[here]) continue;
      visited[here] = true;
      for (const std::uint32_t i : cells.points(here)) group.push_back(points[i]);
      for (int n = 0; n < 27; ++n) {
        const std::uint32_t next = cells.neighbour(here, n);
        if (next != Cells::none && !visited[next]) open.push_back(next);
      }
    }
    result.push_back(std::move(group));
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return result;
}

/// The points within the target's length and width about the set's axis, iterated.
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
    if (kept.size() < min_points || kept.size() == result.points.size()) break;
    result.points = std::move(kept);
    find_axes(result);
  }
  return result;
}

bool is_duplicate(const PointSet& a, const PointSet& b, const TargetSize& size) {
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
  // Depths behind the nearest returns, in target lengths: seen broadside, obliquely, end on.
  constexpr double slice_depths[] = {0.15, 0.35, 0.7, 1.1};
  constexpr std::size_t clusters_per_slice = 2;
  const double length = 2 * size.half_length;

  std::vector<PointSet> result;
  const auto add = [&](const PointSet& set) {
    if (set.points.size() < min_points || result.size() >= at_most) return;
    for (const PointSet& other : result) {
      if (is_duplicate(set, other, size)) return;
    }
    result.push_back(set);
  };
  const auto add_with_trimmed = [&](std::vector<Vector3d> members) {
    if (members.size() < min_points) return;
    PointSet set;
    set.points = std::move(members);
    find_axes(set);
    add(trimmed(set, size));
    add(set);
  };

  std::vector<double> ranges;
  ranges.reserve(points.size());
  for (const Vector3d& p : points) ranges.push_back(p.norm());
  if (ranges.size() < min_points) return result;
  // The first percentile: robust to outliers in front.
  std::vector<double> sorted = ranges;
  const auto hundredth = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 100);
  std::nth_element(sorted.begin(), hundredth, sorted.end());
  const double nearest = *hundredth;
  std::size_t last_size = 0;
  for (const double depth : slice_depths) {
    if (result.size() == at_most) return result;
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
  if (result.size() == at_most) return result;
  auto groups = clusters(points, 0.06 * length);
  for (std::size_t g = 0; g < std::min(groups.size(), clusters_per_slice); ++g) {
    add_with_trimmed(groups[g]);
  }
  add_with_trimmed(points);
  return result;
}

}  // namespace berth::estimator
