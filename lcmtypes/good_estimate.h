// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/pose_estimate_t.hpp>
#include <cmath>
#include <string>

#include "common/core/covariance.h"
#include "common/core/pose.h"

namespace berth {

/// What keeps an estimate from being used although it says OK; empty when nothing does. A pose
/// without a covariance is not known to any accuracy, however sure its estimator is.
inline std::string estimate_defect(const pose_estimate_t& estimate) {
  const Eigen::Map<const Eigen::Vector4d> rotation(estimate.q_wxyz);
  if (!Vector3d::Map(estimate.position_m).allFinite() || !(std::abs(rotation.norm() - 1) < 1e-3)) {
    return "not a pose";
  }
  if (!Vector3d::Map(estimate.linear_velocity_m_s).allFinite() ||
      !Vector3d::Map(estimate.angular_velocity_rad_s).allFinite()) {
    return "its velocity is not a number";
  }
  const std::string defect = covariance_defect(Matrix6d::Map(estimate.covariance));
  return defect.empty() ? "" : "its covariance " + defect;
}

/// Whether an estimate may be relied on: it says OK, and is a pose with a covariance.
inline bool is_good(const pose_estimate_t& estimate) {
  return estimate.status == pose_estimate_t::OK && estimate_defect(estimate).empty();
}

}  // namespace berth
