// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/report/curve.h"
#include "evaluation/report/html.h"

namespace berth::report {

/// A shaded stretch of the x axis.
struct Span {
  enum class Kind { phase, trouble, uncertain };
  double from = 0;
  double to = 0;
  std::string name;  ///< written at its top when it is a phase; shown on hover
  Kind kind = Kind::phase;
};

/// An upright line at an event.
struct Mark {
  double x = 0;
  std::string text;  ///< shown on hover
  bool bad = false;
};

/// A level line with its name: a limit, a bound.
struct Level {
  double y = 0;
  std::string name;
};

struct Chart {
  std::string title;
  std::string unit;           ///< of y
  std::string x_unit = "s";   ///< "" where x is labelled by x_ticks
  std::string group;          ///< charts of one group are zoomed and hovered together
  std::vector<Curve> curves;  ///< drawn in this order
  std::vector<Span> spans;
  std::vector<Mark> marks;
  std::vector<Level> levels;
  std::optional<std::array<double, 2>> x_range;
  std::optional<std::array<double, 2>> y_range;
  std::vector<std::pair<double, std::string>> x_ticks;  ///< instead of numbers
  /// Letters of the longest of x_ticks where these are slanted: words, too long to stand side by
  /// side. 0: they are level.
  std::size_t slanted_letters = 0;
  double min_span = 0;  ///< of y: smaller changes are not magnified
  bool log_y = false;
  /// Few extreme values do not flatten the rest: they are drawn at the edge, and counted below.
  bool clip_extremes = false;
  int height_px = 150;
};

/// The chart as a figure of HTML and SVG: lines with no more points than columns can show (the
/// least and the greatest of each column kept), sharp at any width. page.js adds reading by hover,
/// zoom by dragging, and legends that switch curves off.
Html html_of(const Chart& chart);

/// Charts side by side, as many in a row as there is room for.
Html grid_of(const std::vector<Chart>& charts);

}  // namespace berth::report
