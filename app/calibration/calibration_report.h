// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/calibration/solve_runs.h"

namespace berth {

/// What a calibration found, for a person.
std::string summary_of(const SolvedCalibration& solved);

/// The residuals that the calibration explains, as an SVG that stands alone: of each kind of
/// measurement its distance from the cell's files and from the calibrated cell, on a logarithmic
/// scale, in the order in which they were made.
std::string residual_picture(const SolvedCalibration& solved);

}  // namespace berth
