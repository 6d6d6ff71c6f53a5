// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

Matrix3d position_covariance(const ComparedEstimate& c) {
  return c.truth.covariance.topLeftCorner<3, 3>();
}
Matrix3d attitude_covariance(const ComparedEstimate& c) {
  return c.truth.covariance.bottomRightCorner<3, 3>();
}

Uncertain position_error(const ComparedEstimate& c) {
  return length_of(c.error.head<3>(), position_covariance(c));
}

Uncertain attitude_error(const ComparedEstimate& c) {
  return length_of(c.error.tail<3>(), attitude_covariance(c));
}

Uncertain relative_position_error(const ComparedEstimate& c) {
  const Uncertain error = position_error(c);
  const double range = c.truth.pose.position.norm();
  return {error.value / range, error.truth_sigma / range};
}

template <int axis>
Uncertain axis_error(const ComparedEstimate& c) {
  return {c.error(axis), std::sqrt(std::max(0.0, c.truth.covariance(axis, axis)))};
}

Uncertain range_error(const ComparedEstimate& c) {
  const Vector3d& truth = c.truth.pose.position;
  return {c.estimate.pose.position.norm() - truth.norm(),
          sigma_along(position_covariance(c), truth)};
}

Uncertain bearing_error(const ComparedEstimate& c) {
  const Vector3d& truth = c.truth.pose.position;
  const Vector3d& estimate = c.estimate.pose.position;
  const double range = truth.norm();
  const Vector3d sight = truth / range;
  const Matrix3d across = Matrix3d::Identity() - sight * sight.transpose();
  const Uncertain aside = length_of(across * estimate, across * position_covariance(c) * across);
  return {std::atan2(truth.cross(estimate).norm(), truth.dot(estimate)), aside.truth_sigma / range};
}

Uncertain measured_position_error(const ComparedEstimate& c) {
  return length_of(c.measured_error().head<3>(), position_covariance(c));
}

Uncertain measured_attitude_error(const ComparedEstimate& c) {
  return length_of(c.measured_error().tail<3>(), attitude_covariance(c));
}

}  // namespace

void add_errors(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("errors of pose", table);
  const auto length = berth::Dimension::length;
  const auto angle = berth::Dimension::angle;
  family.estimates("position_error", length, smaller_is_better, position_error,
                   "distance between estimated and true position");
  family.estimates("relative_position_error", berth::Dimension::number, smaller_is_better,
                   relative_position_error, "position error over the true range");
  family.in_percent();
  family.estimates("x_error", length, smaller_is_better, axis_error<0>,
                   "estimated minus true x (right)");
  family.estimates("y_error", length, smaller_is_better, axis_error<1>,
                   "estimated minus true y (down)");
  family.estimates("z_error", length, smaller_is_better, axis_error<2>,
                   "estimated minus true z (along the boresight)");
  family.estimates("attitude_error", angle, smaller_is_better, attitude_error,
                   "angle between estimated and true attitude");
  family.estimates("attitude_x_error", angle, smaller_is_better, axis_error<3>,
                   "attitude error about x");
  family.estimates("attitude_y_error", angle, smaller_is_better, axis_error<4>,
                   "attitude error about y");
  family.estimates("attitude_z_error", angle, smaller_is_better, axis_error<5>,
                   "attitude error about z");
  family.estimates("range_error", length, smaller_is_better, range_error,
                   "estimated minus true distance of the model's origin");
  family.estimates("bearing_error", angle, smaller_is_better, bearing_error,
                   "angle between estimated and true direction of the model's origin");
  family.estimates("measured_position_error", length, smaller_is_better, measured_position_error,
                   "position error of single scans, before the filter");
  family.estimates("measured_attitude_error", angle, smaller_is_better, measured_attitude_error,
                   "attitude error of single scans, before the filter");
}

}  // namespace berth::evaluation
