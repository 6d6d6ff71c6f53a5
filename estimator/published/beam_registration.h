// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/target_model.h"
#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

/// What beams cast at the model in a pose say against that pose. Closest points pair a return with
/// the wrong side of a thin panel when the noise carries it through; a beam knows which side it
/// met.
struct BeamStep {
  Vector6d step = Vector6d::Zero();  ///< least-squares motion of the pose, as berth::perturbed
  double sigma = 0;  ///< robust standard deviation of the residuals along the normals, m
  int used = 0;
};

/// One Gauss-Newton step on the range residuals of about max_beams beams whose residual along the
/// normal is within the gate (m).
BeamStep beam_step(const TargetModel& model, const std::vector<Beam>& beams, const Pose& pose,
                   double gate, std::size_t max_beams);

}  // namespace berth::estimator
