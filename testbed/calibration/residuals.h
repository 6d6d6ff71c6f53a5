// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "testbed/calibration/calibration.h"

namespace berth::testbed {

/// How far one measurement is from what a cell says of it.
struct MeasurementResidual {
  std::string kind;                ///< "scans", "tracker in motion"
  std::string where;               ///< "pose 7"
  double position = 0;             ///< m
  std::optional<double> attitude;  ///< rad; a point has none
};

/// The kinds one after the other, in the order in which they are met, position and attitude apart.
std::vector<CalibrationResidual> summarised(const std::vector<MeasurementResidual>& residuals);

}  // namespace berth::testbed
