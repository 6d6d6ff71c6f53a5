// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/acquire/range_image.h"

namespace berth::estimator {

/// Calls use(beam) for the beams that are at most so many steps to each side of a beam, itself too.
/// A step is as far as beams are apart there.
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

/// Of beams that are marked, those connected with one of them in the image, by steps from beam to
/// beam (at most so many, as for_each_about) that `joined(a, b)`. Takes their marks.
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

/// The connected regions that marked beams consist of. Those where beams are far apart come first:
/// from them it is a step to where they are dense, not the other way.
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

/// The plane of least squares through the returns of beams.
struct FittedPlane {
  Vector3d mean;  ///< m, sensor frame
  Matrix3d axes;  ///< columns: its normal, then the directions of less and of most spread
};
FittedPlane plane_through(const RangeImage& image, const std::vector<int>& beams);

/// Planes that are wider than this, in radii of the target's sphere, cannot be the target's.
constexpr double too_wide = 2.15;

/// Planes that are wider than the target can be (m) and mostly there: floors, walls. Connected in
/// the image, so that a panel in line with the floor is not of it.
struct LargePlanes {
  std::vector<int> of_beam;         ///< which, of each of the image's beams; -1: none
  std::vector<FittedPlane> planes;  ///< through all of their returns

  bool holds(std::size_t beam) const { return of_beam[beam] >= 0; }
};
LargePlanes large_planes(const RangeImage& image, double width);

/// RangeImage::log_background, but a return near a large plane is foretold by that, too, whatever
/// is scanned beside it and hides a part of it: by N(z; range of the plane, s^2), where that is
/// more than anywhere, with the share that is most probable of all of them (expectation
/// maximisation).
std::vector<double> log_background(const RangeImage& image, const LargePlanes& planes);

/// Returns that lie on one plane, connected in the image.
struct PlaneSegments {
  std::vector<int> of_beam;  ///< which, of each beam; -1: none
  std::vector<double> nats;  ///< of each: what it costs to say where it is
};

/// The planes that those returns of a scan (of each beam, whether) consist of, where they do: grown
/// from beam to beam. Faces that are curved are several. Its three parameters, the ranges at three
/// places, are known to s sqrt(3 / n) each by n returns, of anything that was possible; so it costs
///   3 log(depth / (s sqrt(3 / n))) - 1.5 log(2 pi)  nats.
PlaneSegments plane_segments(const RangeImage& image, const std::vector<char>& among);

}  // namespace berth::estimator
