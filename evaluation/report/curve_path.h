// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/report/axis.h"
#include "evaluation/report/chart.h"

namespace berth::report {

/// Charts are drawn in a square of so many units, stretched to the room they are given.
inline constexpr double canvas = 1000;

/// Content of the attribute d of the SVG path that draws the curve.
std::string path_of(const Curve& curve, const Axis& x, const Axis& y);

/// Dots at the edge for the points beyond it; counts them. Of dots and lines only.
std::string clipped_path_of(const Curve& curve, const Axis& x, const Axis& y, std::size_t& count);

}  // namespace berth::report
