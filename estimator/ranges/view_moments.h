// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/target_model.h"

namespace berth::estimator {

/// What evenly spread beams from one direction see of a target: where, and how it is spread. Model
/// frame, m.
struct ViewMoments {
  Vector3d to_viewer = Vector3d::UnitZ();  ///< unit
  Vector3d centroid = Vector3d::Zero();
  Matrix3d scatter = Matrix3d::Zero();  ///< about the centroid, m^2
};

/// For all view directions from which anything is seen: each visible sample of the surface counts
/// as the beams see it, by its area across the beam.
std::vector<ViewMoments> view_moments(const TargetModel& model);

}  // namespace berth::estimator
