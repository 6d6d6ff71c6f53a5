// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/beam/scan.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// How beams that do not meet the target, or do not meet it as they should, are weighed.
struct LikelihoodOptions {
  double model_sigma_m =
      0.006;                ///< of the surface about the mesh, and of a pose not fully polished
  double drop_out = 0.03;   ///< share of beams on the target that return nothing
  double outlier = 0.04;    ///< share of beams on the target with a range of something else
  double background = 0.5;  ///< share of beams past the target that return at all
  double background_depth_m = 6.0;  ///< over which their ranges are spread
};

struct Likelihood {
  double log_likelihood = 0;
  int predicted = 0;  ///< beams that should meet the target
  int explained = 0;  ///< of these, those that returned from where they should
  int through = 0;  ///< of these, those that saw nothing, or something behind: free space where the
                    ///< pose puts the target
};

/// The log-likelihood of every stride-th of a scan's beams for a pose (T_sensor_model), on the
/// shared beam model: hits, misses, returns from behind (free space) and from before (occluders).
Likelihood beam_likelihood(const TargetModel& model, const BeamModel& beam_model,
                           const std::vector<Beam>& beams, const Pose& pose, std::size_t stride,
                           const LikelihoodOptions& options);

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
