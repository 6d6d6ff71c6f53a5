// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/truth_join.h"

#include "evaluation/measure/uncertainty.h"

namespace berth::evaluation {
namespace {

/// Of the estimates that show the same target the one nearest in attitude to truth: pose, measured
/// pose, velocity and covariance. Of a target without symmetry it is the estimate itself.
EstimateSample nearest_equal(const EstimateSample& estimate, const Pose& truth,
                             const SymmetryGroup& symmetry) {
  if (symmetry.trivial()) return estimate;
  EstimateSample equal = estimate;
  equal.pose = symmetry.nearest_equal(estimate.pose, truth);
  equal.measured = symmetry.nearest_equal(estimate.measured, truth);
  // Its origin is another point of the same body, this far from the estimated one.
  const Vector3d lever = equal.pose.position - estimate.pose.position;
  Matrix6d jacobian = Matrix6d::Identity();
  jacobian.topRightCorner<3, 3>() = -skew(lever);
  equal.covariance = jacobian * estimate.covariance * jacobian.transpose();
  equal.velocity.linear += estimate.velocity.angular.cross(lever);
  return equal;
}

}  // namespace

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

std::optional<ComparedEstimate> compare(const EstimateSample& estimate, const TruthTrack& track,
                                        const SymmetryGroup& symmetry, Utime delay) {
  const auto truth = track.at(estimate.utime - delay);
  if (!truth) return std::nullopt;
  ComparedEstimate c{nearest_equal(estimate, truth->pose, symmetry), *truth, {}};
  c.error = difference(truth->pose, c.estimate.pose);
  const TruthVelocity velocity = truth_velocity(track, *truth);
  c.truth.velocity = velocity.velocity;
  c.truth_velocity_covariance = velocity.covariance;
  return c;
}

}  // namespace berth::evaluation
