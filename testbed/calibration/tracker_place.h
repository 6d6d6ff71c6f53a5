// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/cell.h"
#include "testbed/calibration/measurements.h"

namespace berth::testbed {

/// T_tracker_cell that lays the run's readings best over where the cell has the reflectors (Umeyama
/// 1991); the identity where there are fewer than three.
Pose place_tracker(const Cell& cell, const CalibrationRun& run);

}  // namespace berth::testbed
