// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include "common/core/mesh.h"
#include "estimator/model/lanes.h"

namespace berth::estimator {

/// Precomputed closest points of the model (paper, section 4.4): for every voxel of the bounding
/// box and a margin, the surface point nearest to the voxel's centre and its triangle. A look-up
/// needs no search. Model frame, m.
class ClosestPointGrid {
 public:
  struct Match {
    Vector3d point;
    Vector3d normal;  ///< unit, of either sign
  };

  ClosestPointGrid() = default;
  /// Of these triangles only; the others are hidden. About `voxels` voxels.
  ClosestPointGrid(const Mesh& mesh, const std::vector<std::uint32_t>& triangles, double margin,
                   int voxels);

  /// As published: the stored point, good to half a voxel. @return false outside the grid.
  bool stored(const Vector3d& query, Match& match) const;
  /// The exact nearest point of the stored triangle.
  bool refined(const Vector3d& query, Match& match) const;
  /// Voxel of a query; -1 outside the grid. Prefetches the voxel's entry: the table exceeds a
  /// core's cache, and the latencies of several queries overlap.
  std::int64_t voxel(const Vector3d& query) const {
    const std::int64_t i = index(query);
    if (i >= 0) __builtin_prefetch(&nearest_[static_cast<std::size_t>(i)]);
    return i;
  }
  struct FourMatches {
    Four3 point;
    Four3 normal;
  };
  /// As `refined`, of four queries at once. voxels: theirs, all inside.
  FourMatches refined(const Four3& queries, const std::int64_t* voxels) const;
  bool contains(const Vector3d& query) const { return index(query) >= 0; }

  double cell() const { return cell_; }
  const Vector3d& low() const { return low_; }
  const std::array<std::int64_t, 3>& size() const { return size_; }  ///< voxels along x, y, z
  /// From a voxel's centre to its stored point, m.
  double distance_at(std::int64_t x, std::int64_t y, std::int64_t z) const;

 private:
  friend class ModelFile;
  struct Triangle {
    Eigen::Vector3f a, b, c, normal;
  };

  /// Of the voxel; -1 outside.
  std::int64_t index(const Vector3d& query) const {
    const Vector3d cell = (query - low_) / cell_;
    const bool inside = cell.x() >= 0 && cell.x() < static_cast<double>(size_[0]) &&
                        cell.y() >= 0 && cell.y() < static_cast<double>(size_[1]) &&
                        cell.z() >= 0 && cell.z() < static_cast<double>(size_[2]);
    if (!inside) return -1;
    const auto x = static_cast<std::int64_t>(cell.x());
    const auto y = static_cast<std::int64_t>(cell.y());
    const auto z = static_cast<std::int64_t>(cell.z());
    return x + size_[0] * (y + size_[1] * z);
  }
  Vector3d middle_of(std::int64_t x, std::int64_t y, std::int64_t z) const;

  Eigen::Vector3d low_ = Vector3d::Zero();
  double cell_ = 1;
  std::array<std::int64_t, 3> size_{};
  // Of each voxel, in separate arrays: the most used one fits into the cache.
  std::vector<std::uint32_t> nearest_;   // index into triangles_
  std::vector<Eigen::Vector3f> points_;  // on it
  std::vector<Triangle> triangles_;
};

}  // namespace berth::estimator
