// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "estimator/likelihood/beam_likelihood.h"

namespace berth::estimator {

/// Where a beam passes the target most closely.
struct ClosePass {
  double distance = 0;  ///< from the surface, of the target's length; cut off as its distance table
  double range = 0;     ///< m
};

/// direction: unit, sensor frame. To a fiftieth of the length.
ClosePass close_pass(const TargetModel& model, const Pose& pose, const Vector3d& direction);

struct PolishOptions {
  double first_blur = 0.01;   ///< standard deviation of edges at first, of the target's length
  double last_blur = 0.0015;  ///< and at last
  int steps = 4;
  /// Of the length: standard deviation by which, in the first half of the steps, returns are drawn
  /// to the surface that they should be of, see BeamInformationOptions.
  double pull_sigma = 0.01;
};

/// With all its sigmas so many times as large.
BeamModel noisier(BeamModel model, double scale);

/// Gauss-Newton on the beams' log-likelihood with what edges and misses say: they hold what ranges
/// leave open. picks: indices of beams in an order that favours none, as many as are to be used.
Pose polished(const TargetModel& model, const BeamModel& beam_model,
              const LikelihoodOptions& likelihood, std::span<const Beam> beams,
              std::span<const std::uint32_t> picks, const Pose& start,
              const PolishOptions& options);

}  // namespace berth::estimator
