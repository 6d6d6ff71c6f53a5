// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "common/core/pose.h"

namespace berth::estimator {

struct OpenDirectionsOptions {
  int most = 3;               ///< directions
  double least_m = 0.003;     ///< standard deviation along one that is open
  double first_m = 0.08;      ///< step along a direction, at first
  double last_m = 0.01;       ///< and at last; each is half of the one before
  int most_evaluations = 90;  ///< of the cost
};

/// Moves a pose along the directions that its faces leave open (a flat panel along itself, and
/// about its normal) as long as that lowers a cost: a pattern search (Hooke and Jeeves 1961), which
/// needs no derivative and steps over what is in between.
/// @param information of the pose, as berth::perturbed
/// @param radius of the target, m: a turn moves its ends by so much
Pose along_open_directions(const Pose& start, const Matrix6d& information, double radius,
                           const std::function<double(const Pose&)>& cost,
                           const OpenDirectionsOptions& options);

}  // namespace berth::estimator
