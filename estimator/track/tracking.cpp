// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/tracking.h"

#include <cmath>

#include "common/core/text.h"

namespace berth::estimator {

double extremity_sigma(const TargetModel& model, const Matrix6d& covariance) {
  const Vector6d variance = covariance.diagonal();
  const double reach = model.radius;
  return std::sqrt(variance.head<3>().sum() + reach * reach * variance.tail<3>().sum());
}

std::string prediction_mismatch(const TargetModel& model, const Pose& predicted,
                                const Pose& measured, double max_shift_m, double max_turn_rad) {
  const double shift = (measured * model.centre - predicted * model.centre).norm();
  if (shift > max_shift_m) {
    return "the pose is " + fixed(1e3 * shift, 0) + " mm from the prediction, at most " +
           fixed(1e3 * max_shift_m, 0) + " mm is trusted";
  }
  const double turn = angle_between(predicted, measured);
  if (turn > max_turn_rad) {
    return "the attitude is " + fixed(degrees(turn), 1) + " deg from the prediction, at most " +
           fixed(degrees(max_turn_rad), 1) + " deg is trusted";
  }
  return "";
}

}  // namespace berth::estimator
