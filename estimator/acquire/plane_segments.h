// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquire/range_image.h"

namespace berth::estimator {

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
