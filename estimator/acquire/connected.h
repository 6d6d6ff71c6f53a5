// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/acquire/range_image.h"

namespace berth::estimator {

/// Of beams that are marked, those connected with one of them in the image, across one pixel, by
/// steps from beam to beam that `joined(a, b)`. Takes their marks.
template <typename Joined>
std::vector<int> connected(const RangeImage& image, std::vector<char>& marked, int start,
                           const Joined& joined) {
  std::vector<int> found = {start};
  marked[static_cast<std::size_t>(start)] = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const int x = image.pixel_of(found[i]) % image.width();
    const int y = image.pixel_of(found[i]) / image.width();
    for (int v = std::max(0, y - 2); v <= std::min(image.height() - 1, y + 2); ++v) {
      for (int u = std::max(0, x - 2); u <= std::min(image.width() - 1, x + 2); ++u) {
        const int other = image.beam_at(u + image.width() * v);
        if (other < 0 || marked[static_cast<std::size_t>(other)] == 0) continue;
        if (!joined(found[i], other)) continue;
        marked[static_cast<std::size_t>(other)] = 0;
        found.push_back(other);
      }
    }
  }
  return found;
}

}  // namespace berth::estimator
