// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/calibration/solve_runs.h"

namespace berth {

/// What a calibration found, for a person.
std::string summary_of(const SolvedCalibration& solved);

}  // namespace berth
