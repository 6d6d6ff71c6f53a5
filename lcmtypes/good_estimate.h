// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/pose_estimate_t.hpp>
#include <string>

#include "common/core/covariance.h"
#include "lcmtypes/conversions.h"

namespace berth {

/// Why an estimate with the status OK is not usable; empty: it is. A pose without a valid
/// covariance has an unknown accuracy.
inline std::string estimate_defect(const pose_estimate_t& estimate) {
  if (!is_pose(estimate.position_m, estimate.q_wxyz)) return "not a pose";
  const Velocity velocity = velocity_of(estimate);
  if (!velocity.linear.allFinite() || !velocity.angular.allFinite()) {
    return "its velocity is not a number";
  }
  const std::string defect = covariance_defect(covariance_of(estimate.covariance));
  return defect.empty() ? "" : "its covariance " + defect;
}

/// Whether an estimate is usable: its status is OK, and it has a pose with a covariance.
inline bool is_good(const pose_estimate_t& estimate) {
  return estimate.status == pose_estimate_t::OK && estimate_defect(estimate).empty();
}

}  // namespace berth
