// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/pose.h"

namespace berth::clouds {

/// The directions of a scanner that sweeps columns and rows, learnt from the beams that returned:
/// all beams of a column share a longitude, all of a row a latitude, about the scanner's y axis
/// (Berth's sensor frame) or z axis (a surveyor's scanner), whichever fits. Columns and rows
/// without a return lie between, or in line with, the others.
class BeamGrid {
 public:
  /// points: column by column, zero or not finite where nothing came back; rows: of a column.
  BeamGrid(const std::vector<Vector3d>& points, std::size_t rows);

  /// Unit. @return false when nothing tells it.
  bool direction(std::size_t column, std::size_t row, Vector3d& direction) const;
  /// The returns do lie on such a grid.
  bool regular() const { return regular_; }
  /// Median angle between the returns and the grid, rad.
  double misfit_rad() const { return misfit_; }

 private:
  bool about_z_ = false;
  bool regular_ = false;
  double misfit_ = 0;
  std::vector<double> longitude_;  ///< of each column, rad; NaN: unknown
  std::vector<double> latitude_;   ///< of each row, rad; NaN: unknown
};

}  // namespace berth::clouds
