// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/report/colour_scale.h"

namespace berth::report {

/// A value at each of a grid's places, as coloured cells.
struct HeatMap {
  struct Cell {
    double value = 0;   ///< NaN: nothing known
    std::string shown;  ///< written in it
    std::string hover;
  };
  std::string title;
  std::string x_name;
  std::string y_name;
  std::vector<std::string> x_labels;
  std::vector<std::string> y_labels;     ///< from below
  std::vector<std::vector<Cell>> cells;  ///< [y][x]
};

Html html_of(const HeatMap& map, const ColourScale& scale);

}  // namespace berth::report
