// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/distance_table.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

DistanceTable::DistanceTable(const ClosestPointGrid& grid, double cut_off)
    : cell_(static_cast<float>(grid.cell())) {
  // One more voxel on each side: the rim.
  low_ = (grid.low() - Vector3d::Constant(grid.cell())).cast<float>();
  for (std::size_t i = 0; i < 3; ++i) {
    size_[i] = static_cast<int>(grid.size()[i]) + 2;
    top_[i] = static_cast<float>(size_[i] - 1);
  }
  const auto wide = [](int v) { return static_cast<std::size_t>(v); };
  const auto index_of = [&](int x, int y, int z) {
    return wide(x) + wide(size_[0]) * (wide(y) + wide(size_[1]) * wide(z));
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

}  // namespace berth::estimator
