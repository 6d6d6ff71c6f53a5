// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/tracking/tracking.h"

namespace berth::estimator {

struct RefinedPose {
  Pose pose;  ///< T_sensor_model
  Matrix6d covariance = Matrix6d::Identity();
  int used = 0;               ///< returns that fit the target
  double log_likelihood = 0;  ///< of the beams looked at
  std::string doubts;         ///< why it cannot be the target's; else empty
};

/// Refines a pose that may be right to a few degrees: by tracking, and by steps on the beams alone.
/// Tracking may slip along a panel, or lose what misses and silhouettes hold; steps reach less far.
/// The beams' likelihood tells which ended better, or that neither did. start: with the covariance
/// that bounds what the returns do not hold.
RefinedPose refine_pose(const TargetModel& model, const BeamModel& beam_model,
                        const LikelihoodOptions& likelihood, const Tracking& tracking,
                        const CleanScan& scan, const Prediction& start);

}  // namespace berth::estimator
