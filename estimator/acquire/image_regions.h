// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/acquire/range_image.h"

namespace berth::estimator {

/// Calls use(beam) for the first beam of each pixel that is at most `reach` to each side of a
/// beam's own, itself too.
template <typename Use>
void for_each_about(const RangeImage& image, int beam, int reach, const Use& use) {
  const int x = image.pixel_of(beam) % image.width();
  const int y = image.pixel_of(beam) / image.width();
  for (int v = std::max(0, y - reach); v <= std::min(image.height() - 1, y + reach); ++v) {
    for (int u = std::max(0, x - reach); u <= std::min(image.width() - 1, x + reach); ++u) {
      if (const int other = image.beam_at(u + image.width() * v); other >= 0) use(other);
    }
  }
}

/// Of beams that are marked, those connected with one of them in the image, by steps of at most
/// `reach` pixels from beam to beam that `joined(a, b)`. Takes their marks.
template <typename Joined>
std::vector<int> connected(const RangeImage& image, std::vector<char>& marked, int start, int reach,
                           const Joined& joined) {
  std::vector<int> found = {start};
  marked[static_cast<std::size_t>(start)] = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const int from = found[i];
    for_each_about(image, from, reach, [&](int other) {
      char& mark = marked[static_cast<std::size_t>(other)];
      if (mark == 0 || !joined(from, other)) return;
      mark = 0;
      found.push_back(other);
    });
  }
  return found;
}

/// The plane of least squares through the returns of beams.
struct FittedPlane {
  Vector3d mean;  ///< m, sensor frame
  Matrix3d axes;  ///< columns: its normal, then the directions of less and of most spread
};
FittedPlane plane_through(const RangeImage& image, const std::vector<int>& beams);

}  // namespace berth::estimator
