// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/truth_join.h"

#include <algorithm>
#include <cmath>

#include "evaluation/run/target_surface.h"

namespace berth::evaluation {

double sigma_along(const Matrix3d& covariance, const Vector3d& direction) {
  const double length = direction.norm();
  if (length == 0) return std::sqrt(std::max(0.0, covariance.trace()));
  return std::sqrt(std::max(0.0, direction.dot(covariance * direction))) / length;
}

Uncertain length_of(const Vector3d& vector, const Matrix3d& covariance) {
  const double length = vector.norm();
  const double spread = std::sqrt(length * length + std::max(0.0, covariance.trace())) - length;
  return {length, std::max(sigma_along(covariance, vector), spread)};
}

Matrix3d point_covariance(const Matrix6d& pose_covariance, const Vector3d& lever) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << Matrix3d::Identity(), -skew(lever);
  return jacobian * pose_covariance * jacobian.transpose();
}

Matrix3d turned_covariance(const Vector3d& velocity, const Matrix3d& rotation_covariance) {
  const Matrix3d cross = skew(velocity);
  return cross * rotation_covariance * cross.transpose();
}

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

void LiveError::on(const run_info_t& message) { symmetry_ = symmetry_of_run(message); }

void LiveError::on(const pose_estimate_t& message) {
  constexpr std::size_t max_waiting = 100;
  waiting_.push_back(sample_of(message));
  if (waiting_.size() > max_waiting) waiting_.pop_front();
}

void LiveError::on(const ground_truth_t& message) {
  truth_.add_live(sample_of(message));
  const Utime until = truth_.samples().back().utime;
  while (!waiting_.empty() && waiting_.front().utime <= until) {
    if (auto compared = compare(waiting_.front(), truth_, symmetry_)) latest_ = std::move(compared);
    waiting_.pop_front();
  }
}

}  // namespace berth::evaluation
