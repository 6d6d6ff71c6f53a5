// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/acquire/range_image.h"

namespace berth::estimator {

/// Calls use(beam) for all beams at most `steps` spacings to each side of a beam, itself included.
template <typename Use>
void for_each_about(const RangeImage& image, int beam, int steps, const Use& use) {
  const int x = image.pixel_of(beam) % image.width();
  const int y = image.pixel_of(beam) / image.width();
  const int reach = steps * image.pixels_apart(beam);
  for (int v = std::max(0, y - reach); v <= std::min(image.height() - 1, y + reach); ++v) {
    for (int u = std::max(0, x - reach); u <= std::min(image.width() - 1, x + reach); ++u) {
      const auto [from, to] = image.beams_at(u + image.width() * v);
      for (std::size_t other = from; other < to; ++other) use(static_cast<int>(other));
    }
  }
}

/// Region growing: the marked beams connected with `start` in the image by steps (at most `steps`
/// spacings) for which joined(a, b) holds. Clears their marks.
template <typename Joined>
std::vector<int> connected(const RangeImage& image, std::vector<char>& marked, int start, int steps,
                           const Joined& joined) {
  std::vector<int> found = {start};
  marked[static_cast<std::size_t>(start)] = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const int from = found[i];
    for_each_about(image, from, steps, [&](int other) {
      char& mark = marked[static_cast<std::size_t>(other)];
      if (mark == 0 || !joined(from, other)) return;
      mark = 0;
      found.push_back(other);
    });
  }
  return found;
}

/// Connected components of the marked beams. Sparsely scanned beams come first: their steps reach
/// dense ones, not the reverse.
template <typename Joined>
std::vector<std::vector<int>> regions(const RangeImage& image, std::vector<char> marked, int steps,
                                      const Joined& joined) {
  std::vector<int> starts;
  for (std::size_t b = 0; b < marked.size(); ++b) {
    if (marked[b] != 0) starts.push_back(static_cast<int>(b));
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [&](int a, int b) { return image.pixels_apart(a) > image.pixels_apart(b); });
  std::vector<std::vector<int>> found;
  for (const int start : starts) {
    if (marked[static_cast<std::size_t>(start)] == 0) continue;
    found.push_back(connected(image, marked, start, steps, joined));
  }
  return found;
}

/// The least-squares plane through returns.
struct FittedPlane {
  Vector3d mean;  ///< m, sensor frame
  Matrix3d axes;  ///< columns: normal, direction of less spread, direction of most spread
};
FittedPlane plane_through(const RangeImage& image, const std::vector<int>& beams);

/// A plane wider than this, in radii of the target's sphere, is not the target's.
constexpr double max_plane_radii = 2.15;

/// Planes wider than the target, such as floors and walls, connected in the image: a panel coplanar
/// with the floor but separate from it is not included.
struct LargePlanes {
  std::vector<int> of_beam;         ///< index of each beam's segment; -1: none
  std::vector<FittedPlane> planes;  ///< through all of their returns

  bool holds(std::size_t beam) const { return of_beam[beam] >= 0; }
};
/// Found by RANSAC [Fischler, Bolles 1981], weighted by area. width: m.
LargePlanes large_planes(const RangeImage& image, double width);

/// RangeImage::log_background with large planes as another predictor: a return near a plane is
/// predicted by N(z; range of the plane, s^2), with the weight estimated by expectation
/// maximisation.
std::vector<double> log_background(const RangeImage& image, const LargePlanes& planes);

/// Planar segments: returns on one plane, connected in the image.
struct PlaneSegments {
  std::vector<int> of_beam;         ///< which, of each beam; -1: none
  std::vector<double> code_length;  ///< nats: description length of each segment's plane
};

/// Planar segments of the marked beams, by region growing; curved faces are divided. n returns
/// determine the plane's three parameters, the ranges at three points, to s sqrt(3 / n) each,
/// within the depth; the description length is
///   3 log(depth / (s sqrt(3 / n))) - 1.5 log(2 pi)  nats.
PlaneSegments plane_segments(const RangeImage& image, const std::vector<char>& candidates);

}  // namespace berth::estimator
