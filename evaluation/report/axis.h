// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth::report {

/// A stretch of numbers on an axis, linear or logarithmic.
struct Axis {
  double low = 0;
  double high = 1;
  bool logarithmic = false;

  /// 0 at low, 1 at high.
  double fraction(double value) const;
};

struct Tick {
  double value;
  std::string label;
};

/// About `count` multiples of a round number (1, 2 or 5 times a power of ten) inside the axis, with
/// a count of 3 or more at least two; of a logarithmic one, powers of ten.
std::vector<Tick> ticks(const Axis& axis, int count);

/// The axis that shows these values with a little air around them, never empty. Values that are not
/// finite (of a logarithmic axis: not positive) do not count.
Axis axis_for(const std::vector<double>& values, bool logarithmic);
/// The same, but where the 2 % of values furthest out would take more than half of the axis they do
/// not count.
Axis axis_without_extremes(std::vector<double> values, bool logarithmic);

/// A number for a person: so many significant digits, thousands not as powers.
std::string brief(double value, int digits = 4);

}  // namespace berth::report
