// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/beam/scan.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Parameters of the beam mixture.
struct LikelihoodOptions {
  double model_sigma_m = 0.006;     ///< of the surface about the mesh, and of an unrefined pose
  double drop_out = 0.03;           ///< probability that a beam on the target does not return
  double outlier = 0.04;            ///< probability of an outlier on the target
  double background = 0.5;          ///< probability that a beam past the target returns
  double background_depth_m = 6.0;  ///< over which ranges of the background are uniform
};

/// Log-likelihood and the counts of beams by outcome.
struct Likelihood {
  double log_likelihood = 0;
  int predicted = 0;  ///< beams that should meet the target
  int explained = 0;  ///< of these, beams that returned from it
  int through = 0;    ///< of these, beams that did not return or returned from behind it
};

/// Log-likelihood of every stride-th beam of a scan for a pose (T_sensor_model) under the beam
/// model: returns from the target, from behind it (free space) and before it (occluders), and beams
/// without return.
Likelihood beam_likelihood(const TargetModel& model, const BeamModel& beam_model,
                           const std::vector<Beam>& beams, const Pose& pose, std::size_t stride,
                           const LikelihoodOptions& options);

/// A Gauss-Newton step on range residuals.
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
