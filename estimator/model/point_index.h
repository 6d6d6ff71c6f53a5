// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// Points sorted into cubes, for neighbour queries of one fixed radius. Deterministic order.
class PointIndex {
 public:
  PointIndex(const std::vector<Vector3d>& points, double cell) : points_(points), cell_(cell) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      cells_[key(points[i])].push_back(static_cast<std::uint32_t>(i));
    }
  }

  /// Calls visit(index) for every point within radius <= cell of the query.
  template <class Visit>
  void for_neighbours(const Vector3d& query, double radius, Visit visit) const {
    const auto [x, y, z] = key(query);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto found = cells_.find({x + dx, y + dy, z + dz});
          if (found == cells_.end()) continue;
          for (const std::uint32_t i : found->second) {
            if ((points_[i] - query).squaredNorm() <= radius * radius) visit(i);
          }
        }
      }
    }
  }

 private:
  using Key = std::tuple<int, int, int>;
  Key key(const Vector3d& p) const {
    return {static_cast<int>(std::floor(p.x() / cell_)),
            static_cast<int>(std::floor(p.y() / cell_)),
            static_cast<int>(std::floor(p.z() / cell_))};
  }

  const std::vector<Vector3d>& points_;
  double cell_;
  std::map<Key, std::vector<std::uint32_t>> cells_;
};

}  // namespace berth::estimator
