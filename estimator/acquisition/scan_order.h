// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

/// Indices of the beams in an order that looks random and does not depend on the order in which
/// they came: any first part of it is a fair sample of the scan.
std::vector<std::uint32_t> shuffled(const std::vector<Beam>& beams);

/// `count` of the points or fewer, spread evenly over them; every second, fourth ... of the result
/// is spread evenly too.
std::vector<Vector3d> spread_points(const std::vector<Vector3d>& points, std::size_t count);

}  // namespace berth::estimator
