// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/truth_velocity.h"

#include "evaluation/measure/uncertainty.h"

namespace berth::evaluation {

TruthVelocity truth_velocity(const TruthTrack& track, const TruthSample& truth) {
  constexpr Utime half_window = 50 * millisecond;
  TruthVelocity result{truth.velocity, Matrix6d::Zero()};
  const auto before = track.at(truth.utime - half_window);
  const auto after = track.at(truth.utime + half_window);
  if (before && after) {
    const double h = seconds(half_window);
    const Velocity past = velocity_between(before->pose, truth.pose, h);
    const Velocity future = velocity_between(truth.pose, after->pose, h);
    result.velocity.linear = (past.linear + future.linear) / 2;
    result.velocity.angular = (past.angular + future.angular) / 2;
    Vector6d change;
    change << future.linear - past.linear, future.angular - past.angular;
    result.covariance.diagonal() = change.cwiseAbs2() / 12;
  }
  const Matrix3d turn = truth.covariance.bottomRightCorner<3, 3>();
  result.covariance.topLeftCorner<3, 3>() += turned_covariance(result.velocity.linear, turn);
  result.covariance.bottomRightCorner<3, 3>() += turned_covariance(result.velocity.angular, turn);
  return result;
}

}  // namespace berth::evaluation
