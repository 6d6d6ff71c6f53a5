// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "app/runs/run_files.h"
#include "testbed/calibration/solver.h"

namespace berth {

/// A calibration with all that was found on the way.
struct SolvedCalibration {
  testbed::Calibration calibration;
  testbed::CalibrationSolution solution;
  Eigen::MatrixXd prior;
  std::vector<std::string> left_out;  ///< poses at which the target was not seen, and why
  std::int64_t poses = 0;             ///< at rest
  std::int64_t moving = 0;            ///< scans
  std::int64_t readings = 0;
  double truth_position = 0;  ///< m, rms of what truth is still uncertain by at the poses
  double truth_rotation = 0;  ///< rad
};

/// Solves from recorded runs of one layout, target and configuration.
/// @param trackers one file per run; empty: none of that run
/// @param made UTC
/// @throws InputError.
SolvedCalibration solve_runs(const std::vector<RunFiles>& runs,
                             const std::vector<std::filesystem::path>& trackers,
                             const std::string& made);

}  // namespace berth
