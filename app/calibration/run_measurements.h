// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/reflectors.h"
#include "testbed/calibration/measurements.h"

namespace berth {

/// Steps at which a calibration waited for the target in vain, and why: "pose 3 of 48: ...".
/// @throws InputError when the log cannot be read.
std::vector<std::string> poses_left_out(const std::filesystem::path& log);

/// What a recorded run holds for calibration: estimates while the arms rested, as one pose each
/// with the scatter of its scans, those while they moved steadily one by one, and what a tracker
/// saw meanwhile. Estimates lag behind an acceleration: those scans do not determine the clocks.
/// @param nominal gives the accelerations
/// @param tracker_file empty: none
/// @throws InputError when the log cannot be read or holds nothing of the kind.
testbed::CalibrationRun read_calibration_run(const std::filesystem::path& log, const Cell& nominal,
                                             const TrackerSetup& setup,
                                             const std::filesystem::path& tracker_file);

}  // namespace berth
