// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"
#include "common/core/random.h"

namespace berth::estimator {

/// Of the poses that a filter is given in tests, in every direction.
inline constexpr double sigma_m = 0.003;
inline constexpr double sigma_rad = 0.002;

inline Matrix6d noise() {
  Vector6d v;
  v << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma_rad * sigma_rad);
  return v.asDiagonal();
}

inline Pose measured(const Pose& truth, Random& random) {
  Vector6d d;
  d << random.normal_vector(sigma_m), random.normal_vector(sigma_rad);
  return perturbed(truth, d);
}

}  // namespace berth::estimator
