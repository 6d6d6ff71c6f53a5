// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "estimator/model/target_model.h"

namespace berth::estimator {

struct BeamApproachOptions {
  int max_iterations = 15;
  double widest_m = 0.3;      ///< distance from the model at which a point is without weight,
  double narrowest_m = 0.04;  ///< at first and at last
  double scale_sigmas = 4;    ///< between them: so many robust standard deviations
  double stop_m = 0.002;      ///< a step that moves the target's ends by less is the last
};

/// The pose to within a few millimetres from up to some decimetres, by the distance of a few
/// hundred points to the nearest surface (precomputed). Beside a face the distance has a part along
/// the face: it is what pulls a panel along itself when returns come from beyond its end. Robust:
/// what is far from the model has no weight. points: sensor frame at the time of the pose, m.
Pose approach(const TargetModel& model, std::span<const Vector3d> points, const Pose& start,
              const BeamApproachOptions& options);

}  // namespace berth::estimator
