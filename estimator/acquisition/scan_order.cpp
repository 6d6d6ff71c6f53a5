// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/scan_order.h"

#include <algorithm>
#include <array>
#include <bit>

namespace berth::estimator {

namespace {

/// The finaliser of SplitMix64.
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

std::uint32_t hash_of(const Beam& beam) {
  const auto x = std::bit_cast<std::uint64_t>(beam.direction.x());
  const auto y = std::bit_cast<std::uint64_t>(beam.direction.y());
  const auto range = std::bit_cast<std::uint64_t>(beam.range);
  return static_cast<std::uint32_t>(mixed(x + mixed(y + mixed(range))));
}

/// The bits of a number below 1024, two zeros after each.
std::uint32_t spaced_out(std::uint32_t x) {
  x = (x | (x << 16)) & 0x030000ffU;
  x = (x | (x << 8)) & 0x0300f00fU;
  x = (x | (x << 4)) & 0x030c30c3U;
  return (x | (x << 2)) & 0x09249249U;
}

}  // namespace

std::vector<std::uint32_t> shuffled(const std::vector<Beam>& beams) {
  // A radix sort by the hash: two passes of 11 bits, so that equal keys are rare.
  constexpr std::uint32_t radix = 1U << 11;
  struct Item {
    std::uint32_t hash, index;
  };
  std::vector<Item> items(beams.size());
  std::vector<Item> sorted(beams.size());
  for (std::size_t i = 0; i < beams.size(); ++i) {
    items[i] = {hash_of(beams[i]), static_cast<std::uint32_t>(i)};
  }
  for (const int shift : {0, 11}) {
    std::array<std::uint32_t, radix> start{};
    for (const Item& item : items) ++start[(item.hash >> shift) % radix];
    std::uint32_t sum = 0;
    for (std::uint32_t& s : start) {
      const std::uint32_t count = s;
      s = sum;
      sum += count;
    }
    for (const Item& item : items) sorted[start[(item.hash >> shift) % radix]++] = item;
    items.swap(sorted);
  }
  std::vector<std::uint32_t> order(beams.size());
  for (std::size_t i = 0; i < beams.size(); ++i) order[i] = items[i].index;
  return order;
}

std::vector<Vector3d> spread_points(const std::vector<Vector3d>& points, std::size_t count) {
  // Along a space-filling (Morton) curve through some more points, each so-manieth is taken.
  const std::size_t n = std::min(points.size(), 8 * count);
  if (n == 0) return {};
  const auto chosen = [&](std::size_t i) { return i * points.size() / n; };
  Vector3d low = points[0];
  Vector3d high = points[0];
  for (std::size_t i = 0; i < n; ++i) {
    low = low.cwiseMin(points[chosen(i)]);
    high = high.cwiseMax(points[chosen(i)]);
  }
  const double scale = 1023 / std::max((high - low).maxCoeff(), 1e-9);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> curve(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vector3d place = (points[chosen(i)] - low) * scale;
    curve[i] = {spaced_out(static_cast<std::uint32_t>(place.x())) |
                    spaced_out(static_cast<std::uint32_t>(place.y())) << 1 |
                    spaced_out(static_cast<std::uint32_t>(place.z())) << 2,
                static_cast<std::uint32_t>(chosen(i))};
  }
  std::sort(curve.begin(), curve.end());
  std::vector<Vector3d> result;
  const std::size_t taken = std::min(n, count);
  for (std::size_t i = 0; i < taken; ++i) {
    result.push_back(points[curve[(2 * i + 1) * n / (2 * taken)].second]);
  }
  return result;
}

}  // namespace berth::estimator
