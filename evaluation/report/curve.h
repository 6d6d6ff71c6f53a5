// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/svg.h"
#include "evaluation/report/axis.h"

namespace berth::report {

/// One drawn quantity. y that is not finite breaks a line and leaves a dot out.
struct Curve {
  enum class Style {
    line,   ///< y over x
    steps,  ///< y holds until the next x
    dots,   ///< a dot per point
    band,   ///< the area between y and low
    bars,   ///< from 0 to y, each bar from its x to the next; the last x only ends the last bar
    range,  ///< an upright line from low to y: an interval
  };
  std::string name;  ///< in the legend; empty: not listed
  Style style = Style::line;
  int colour = 0;  ///< 0: grey, for what others are compared with; 1 to 7: distinct for the
                   ///< colour-blind, too
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::vector<double> low = {};  ///< of band and range
  bool dashed = false;

  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
  void add(double at, double lower, double upper) {
    add(at, upper);
    low.push_back(lower);
  }
};

/// Charts are drawn in a square of so many units, stretched to the room they are given.
inline constexpr double canvas = 1000;

/// The path that draws the curve.
svg::Path path_of(const Curve& curve, const Axis& x, const Axis& y);

/// Dots at the edge for the points beyond it; counts them. Of dots and lines only.
svg::Path clipped_path_of(const Curve& curve, const Axis& x, const Axis& y, std::size_t& count);

/// The points worth drawing where x from low to high is so many columns wide: of each column the
/// first, the least, the greatest and the last, in the order of x, and every point that is not
/// finite and breaks the line. Indices into x and y. Short curves are kept whole.
/// x must not decrease.
std::vector<std::size_t> worth_drawing(const std::vector<double>& x, const std::vector<double>& y,
                                       double low, double high, std::size_t columns);

}  // namespace berth::report
