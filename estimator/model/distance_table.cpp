// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/distance_table.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

DistanceTable::DistanceTable(const ClosestPointGrid& grid, double cut_off)
    : cell_(static_cast<float>(grid.cell())), cut_off_(cut_off) {
  // One more voxel on each side: the rim.
  low_ = (grid.low() - Vector3d::Constant(grid.cell())).cast<float>();
  for (std::size_t i = 0; i < 3; ++i) {
    size_[i] = static_cast<int>(grid.size()[i]) + 2;
    top_[i] = static_cast<float>(size_[i] - 1);
  }
  const auto index_of = [&](int x, int y, int z) {
    return static_cast<std::size_t>(x + size_[0] * (y + size_[1] * z));
  };
  values_.assign(index_of(0, 0, size_[2]), std::uint8_t{most});
  const double scale = most / cut_off;
  for (int z = 1; z + 1 < size_[2]; ++z) {
    for (int y = 1; y + 1 < size_[1]; ++y) {
      for (int x = 1; x + 1 < size_[0]; ++x) {
        const double distance = grid.distance_at(x - 1, y - 1, z - 1);
        values_[index_of(x, y, z)] =
            static_cast<std::uint8_t>(std::min<double>(most, std::lround(distance * scale)));
      }
    }
  }
}

/// Sphere tracing (Hart 1996): nothing is nearer than the distance says, so that much is skipped.
bool DistanceTable::may_come_near(const Vector3d& origin, const Vector3d& direction,
                                  double distance) const {
  const Eigen::Vector3f from = (origin.cast<float>() - low_) / cell_;  // voxels, as all below
  const Eigen::Vector3f along = direction.cast<float>();
  float t = 0;
  float end = 1e30F;
  for (int i = 0; i < 3; ++i) {
    const float to_low = (1 - from[i]) / along[i];
    const float to_high = (top_[static_cast<std::size_t>(i)] - from[i]) / along[i];
    t = std::max(t, std::min(to_low, to_high));
    end = std::min(end, std::max(to_low, to_high));
  }
  const float unit = static_cast<float>(cut_off_) / (most * cell_);
  constexpr float half_diagonal = 0.87F;
  const float near = static_cast<float>(distance) / cell_ + half_diagonal;
  while (t < end) {
    const Eigen::Vector3f at = from + t * along;
    const float free = unit * static_cast<float>(value(index(at.x(), at.y(), at.z()))) - near;
    if (free <= 0) return true;
    t += std::max(free, 0.5F);
  }
  return false;
}

}  // namespace berth::estimator
