// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/run_setup.h"
#include "testbed/calibration/pose_selection.h"

namespace berth {

/// How the poses of a calibration are gone to and looked at.
struct CalibrationPace {
  int estimates = 12;  ///< at each pose
  int returns = 1200;  ///< of a scan
  int strokes = 16;    ///< with each arm, there and back counting two
  double speed = 0.1;  ///< m/s between poses
  double turn = radians(5);
};

/// The procedure that goes to the poses chosen: it can be read, kept and run again like any other.
std::string calibration_procedure(const RunSetup& setup, const testbed::PoseSelection& selection,
                                  const Pose& home, const testbed::CalibrationView& view,
                                  const CalibrationPace& pace);

}  // namespace berth
