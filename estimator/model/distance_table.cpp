// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/distance_table.h"

#include <immintrin.h>

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

/// Sphere tracing (Hart 1996), eight rays at a time: nothing is nearer than the distance says, so
/// that much is skipped.
void DistanceTable::may_come_near(std::span<const Ray> rays, double distance,
                                  std::span<bool> near) const {
  constexpr std::size_t width = 8;
  using Floats = float __attribute__((vector_size(4 * width)));
  using Ints = int __attribute__((vector_size(4 * width)));
  const float unit = static_cast<float>(cut_off_) / (most * cell_);
  const auto reach = static_cast<float>(distance / double{cell_} + half_diagonal);
  for (std::size_t first = 0; first < rays.size(); first += width) {
    const std::size_t count = std::min(width, rays.size() - first);
    std::array<Floats, 3> from{};  // voxels, as all below
    std::array<Floats, 3> along{};
    for (std::size_t i = 0; i < width; ++i) {
      const Ray& ray = rays[first + std::min(i, count - 1)];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        from[axis][i] = (static_cast<float>(ray.origin[a]) - low_[a]) / cell_;
        along[axis][i] = static_cast<float>(ray.direction[a]);
      }
    }
    Floats t{};
    Floats end = Floats{} + 1e30F;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Floats to_low = (1 - from[axis]) / along[axis];
      const Floats to_high = (top_[axis] - from[axis]) / along[axis];
      const Floats enter = to_low < to_high ? to_low : to_high;
      const Floats leave = to_low < to_high ? to_high : to_low;
      t = enter > t ? enter : t;
      end = leave < end ? leave : end;
    }
    const auto place = [&](std::size_t axis) {
      const Floats at = from[axis] + t * along[axis];
      const Floats low = at < 0 ? Floats{} : at;
      const Floats inside = low > top_[axis] ? Floats{} + top_[axis] : low;
      return __builtin_convertvector(inside, Ints);
    };
    const auto any = [](const Ints& mask) {
      return _mm256_movemask_epi8(reinterpret_cast<__m256i>(mask)) != 0;
    };
    Ints found{};
    Ints open = t < end;
    while (any(open)) {
      const Ints index = place(0) + size_[0] * (place(1) + size_[1] * place(2));
      Ints value;
      for (std::size_t i = 0; i < width; ++i)
        value[i] = values_[static_cast<std::size_t>(index[i])];
      const Floats free = unit * __builtin_convertvector(value, Floats) - reach;
      found |= open & (free <= 0);
      t += free > 0.5F ? free : Floats{} + 0.5F;
      open &= ~found & (t < end);
    }
    for (std::size_t i = 0; i < count; ++i) near[first + i] = found[i] != 0;
  }
}

}  // namespace berth::estimator
