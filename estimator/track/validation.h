// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/beam/scan.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Limits of validation.
struct ValidationOptions {
  double max_outlier_share = 0.2;  ///< of the returns near the target that do not lie on it
  double max_through = 0.25;       ///< of the beams on it, not occluded, that pass through it
  double near = 0.1;               ///< distance of returns near the target, over its length
  double min_spread =
      0.01;              ///< of the returns near the target across their extent, over its length
  int max_beams = 2000;  ///< of a scan that are checked
};

/// A predictive check of a pose (T_sensor_model): empty, or why it contradicts the scan. A
/// likelihood compares poses of one target; this tests the hypothesis that it is the target. Part
/// of a larger body leaves outliers, a smaller body is passed through, and returns on a line or in
/// a point do not determine a pose.
std::string validation_failure(const TargetModel& model, const BeamModel& beam_model,
                               const PreprocessedScan& scan, const Pose& pose,
                               const ValidationOptions& options = {});

}  // namespace berth::estimator
