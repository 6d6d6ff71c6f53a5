// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquire/range_image.h"

namespace berth::estimator {

/// Of each of the image's beams, whether it returned from a plane that is wider than the target can
/// be (m) and mostly there: floors, walls. Connected in the image, so that a panel in line with the
/// floor is not of it.
std::vector<char> on_large_planes(const RangeImage& image, double width, double sigma);

}  // namespace berth::estimator
