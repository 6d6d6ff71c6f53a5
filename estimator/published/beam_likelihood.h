// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/target_model.h"
#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

/// How beams that do not meet the target, or do not meet it as they should, are weighed.
struct LikelihoodOptions {
  double model_sigma_m =
      0.006;                ///< of the surface about the mesh, and of a pose not fully polished
  double noise_scale = 1;   ///< on the sigmas of the beam model
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
  int missed = 0;   ///< of those, the ones that saw nothing
  int past = 0;     ///< beams that should not meet the target
  int past_returned = 0;  ///< of these, those that returned from something

  /// Of the beams that should meet the target, those that something else returned before it.
  int occluded() const { return predicted - explained - through; }
};

/// The log-likelihood of beams for a pose (T_sensor_model), on the shared beam model: hits, misses,
/// returns from behind (free space) and from before (occluders). Beams are added one by one, so
/// that poses can be weighed against each other until enough is known. What is passed in must
/// outlive it.
class BeamLikelihood {
 public:
  BeamLikelihood(const TargetModel& model, const BeamModel& beam_model,
                 const LikelihoodOptions& options, const Pose& pose);

  void add(const Beam& beam);
  const Likelihood& sum() const { return sum_; }

 private:
  const TargetModel* model_;
  double range_variance_, angle_variance_, model_variance_;
  double log_miss_past_, log_hit_past_, log_drop_out_;
  double outlier_density_, on_target_;
  Matrix3d rotation_;  // sensor to model
  Vector3d origin_;    // of the beams, model frame
  Vector3d to_centre_;
  double far_, squared_reach_;
  Likelihood sum_;
};

/// The same of every stride-th of a scan's beams.
Likelihood beam_likelihood(const TargetModel& model, const BeamModel& beam_model,
                           const std::vector<Beam>& beams, const Pose& pose, std::size_t stride,
                           const LikelihoodOptions& options);

}  // namespace berth::estimator
