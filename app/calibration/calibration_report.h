// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/calibration/solve_runs.h"

namespace berth {

/// What a calibration found, for a person.
std::string summary_of(const SolvedCalibration& solved);

/// What the calibration explains, as an SVG that stands alone: of each kind of measurement how far
/// every one is from what the cell's files say of it, and from what the calibrated cell says, on a
/// logarithmic scale, in the order in which they were made.
std::string residual_picture(const SolvedCalibration& solved);

}  // namespace berth
