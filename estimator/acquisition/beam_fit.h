// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "estimator/model/target_model.h"
#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

struct BeamFit {
  Pose pose;  ///< T_sensor_model
  /// Of the returns used, for a motion [translation; rotation vector] about the target's centre in
  /// sensor axes.
  Matrix6d information = Matrix6d::Zero();
  int used = 0;
};

/// Gauss-Newton on range residuals: each return is compared with what its beam meets in the pose,
/// or, where it meets nothing near, with the nearest surface. Residuals beyond the gate (m along
/// the normal, shrinking from first to last) count less and less. beams: hits only.
BeamFit fit_beams(const TargetModel& model, const BeamModel& beam_model,
                  std::span<const Beam> beams, const Pose& start, double first_gate,
                  double last_gate, int iterations);

/// `pose` moved by d = [translation; rotation vector] (sensor axes) about the target's centre.
Pose moved_about_centre(const TargetModel& model, const Pose& pose, const Vector6d& d);

}  // namespace berth::estimator
