// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/sphere_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace berth::campaigns {

using std::numbers::pi;

SphereGrid::SphereGrid(std::size_t wanted) {
  const double side = std::sqrt(4 * pi / static_cast<double>(std::max<std::size_t>(wanted, 1)));
  const auto rings = static_cast<std::size_t>(std::max(1.0, std::round(pi / side)));
  std::vector<std::size_t> counts;
  std::size_t total = 0;
  for (std::size_t i = 0; i < rings; ++i) {
    const double polar = pi * (static_cast<double>(i) + 0.5) / static_cast<double>(rings);
    const double count = std::round(2 * pi * std::sin(polar) / side);
    counts.push_back(static_cast<std::size_t>(std::max(rings == 1 ? 1.0 : 3.0, count)));
    total += counts.back();
  }
  double north = 1;
  for (const std::size_t count : counts) {
    const std::size_t first = cells_.size();
    const double south = 1 - 2 * static_cast<double>(first + count) / static_cast<double>(total);
    rings_.push_back({south, first, count});
    for (std::size_t i = 0; i < count; ++i) {
      const double step = 2 * pi / static_cast<double>(count);
      const double west = -pi + static_cast<double>(i) * step;
      cells_.push_back({west, west + step, std::asin(std::max(-1.0, south)), std::asin(north)});
    }
    north = south;
  }
}

std::size_t SphereGrid::cell_at(const Vector3d& direction) const {
  const double z = direction.z() / direction.norm();
  auto ring = rings_.begin();
  while (z < ring->south_z && std::next(ring) != rings_.end()) ++ring;
  const double turn = (std::atan2(direction.y(), direction.x()) + pi) / (2 * pi);
  const auto place = static_cast<std::size_t>(turn * static_cast<double>(ring->count));
  return ring->first + std::min(place, ring->count - 1);
}

}  // namespace berth::campaigns
