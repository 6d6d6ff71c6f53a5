// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "evaluation/report/html.h"

namespace berth::report {

/// A few classes of values, from calm to alarming, as colours that differ in lightness too:
/// page.css has q0 to q6, and qn for nothing known.
class ColourScale {
 public:
  static constexpr std::size_t colours = 7;

  /// Class i holds what is not above ends[i] (nor below class i - 1); a last class the rest.
  /// @param ends rising, at most six
  ColourScale(std::vector<double> ends, std::string unit);

  /// Classes of round numbers that show these values apart: linear, or where they span more than a
  /// decade 1, 2, 5, 10 ...
  static ColourScale for_values(std::vector<double> values, std::string unit);

  /// "q0" ... "q6"; "qn" for NaN. Classes are spread over the colours.
  std::string class_of(double value) const;
  /// The colours with what they mean.
  Html legend() const;
  const std::string& unit() const { return unit_; }

 private:
  std::size_t colour_of(std::size_t place) const;

  std::vector<double> ends_;
  std::string unit_;
};

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
