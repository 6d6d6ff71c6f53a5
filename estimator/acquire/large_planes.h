// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquire/image_regions.h"

namespace berth::estimator {

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

}  // namespace berth::estimator
