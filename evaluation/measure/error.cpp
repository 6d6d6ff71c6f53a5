// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/core/nan.h"
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

namespace {

Vector6d vector_of(const Velocity& velocity) {
  Vector6d v;
  v << velocity.linear, velocity.angular;
  return v;
}

Vector6d velocity_difference(const ComparedEstimate& c) {
  return vector_of(c.estimate.velocity) - vector_of(c.truth.velocity);
}

Uncertain velocity_error(const ComparedEstimate& c) {
  return length_of(velocity_difference(c).head<3>(),
                   c.truth_velocity_covariance.topLeftCorner<3, 3>());
}

Uncertain angular_velocity_error(const ComparedEstimate& c) {
  return length_of(velocity_difference(c).tail<3>(),
                   c.truth_velocity_covariance.bottomRightCorner<3, 3>());
}

template <int axis>
Uncertain velocity_axis_error(const ComparedEstimate& c) {
  return {velocity_difference(c)(axis), std::sqrt(c.truth_velocity_covariance(axis, axis))};
}

/// Slope of the estimated over the true velocity of one axis, through the origin: 1 when right, -1
/// for a sign that is wrong, 0 for what does not follow.
template <int axis>
Measured gain(const Measurer& measurer, const Phase& phase) {
  double product = 0;
  double square = 0;
  double truth_variance = 0;
  std::int64_t samples = 0;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    const double truth = vector_of(c.truth.velocity)(axis);
    product += vector_of(c.estimate.velocity)(axis) * truth;
    square += truth * truth;
    truth_variance += c.truth_velocity_covariance(axis, axis);
    ++samples;
  }
  if (samples < 3) return {nan, 0, samples, "fewer than three estimates"};
  if (square == 0 || square <= 9 * truth_variance) {
    return {nan, 0, samples, "the target does not move enough along this axis"};
  }
  const double slope = product / square;
  double residual = 0;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    const double off =
        vector_of(c.estimate.velocity)(axis) - slope * vector_of(c.truth.velocity)(axis);
    residual += off * off;
  }
  const double scatter = residual / static_cast<double>(samples - 1) / square;
  return {slope, std::sqrt(scatter + slope * slope * truth_variance / square), samples, ""};
}

double right_gain(Statistic) { return 1; }

Series relative_speed(const Measurer& measurer, const Phase& phase) {
  return truth_series(
      [&measurer](const TruthSample& truth) {
        const TruthVelocity v = truth_velocity(measurer.record().truth(), truth);
        return length_of(v.velocity.linear, v.covariance.topLeftCorner<3, 3>());
      },
      measurer, phase);
}

}  // namespace

void add_velocities(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("velocities", table);
  const auto speed = berth::Dimension::speed;
  const auto turn = berth::Dimension::angular_speed;
  const auto number = berth::Dimension::number;
  family.estimates("velocity_error", speed, smaller_is_better, velocity_error,
                   "length of estimated minus true linear velocity");
  family.detail().estimates("velocity_x_error", speed, smaller_is_better, velocity_axis_error<0>,
                            "estimated minus true velocity along x");
  family.detail().estimates("velocity_y_error", speed, smaller_is_better, velocity_axis_error<1>,
                            "along y");
  family.detail().estimates("velocity_z_error", speed, smaller_is_better, velocity_axis_error<2>,
                            "along z");
  family.estimates("angular_velocity_error", turn, smaller_is_better, angular_velocity_error,
                   "length of estimated minus true angular velocity");
  family.detail().estimates("angular_velocity_x_error", turn, smaller_is_better,
                            velocity_axis_error<3>,
                            "estimated minus true angular velocity about x");
  family.detail().estimates("angular_velocity_y_error", turn, smaller_is_better,
                            velocity_axis_error<4>, "about y");
  family.detail().estimates("angular_velocity_z_error", turn, smaller_is_better,
                            velocity_axis_error<5>, "about z");
  family.number("velocity_x_gain", number, smaller_is_better, gain<0>,
                "estimated over true velocity along x, least squares: 1 when right, -1 when its "
                "sign is wrong");
  family.best_near(right_gain);
  family.number("velocity_y_gain", number, smaller_is_better, gain<1>, "along y");
  family.best_near(right_gain);
  family.number("velocity_z_gain", number, smaller_is_better, gain<2>, "along z");
  family.best_near(right_gain);
  family.number("angular_velocity_x_gain", number, smaller_is_better, gain<3>,
                "estimated over true angular velocity about x: 1 when right, -1 when its sign is "
                "wrong");
  family.best_near(right_gain);
  family.number("angular_velocity_y_gain", number, smaller_is_better, gain<4>, "about y");
  family.best_near(right_gain);
  family.number("angular_velocity_z_gain", number, smaller_is_better, gain<5>, "about z");
  family.best_near(right_gain);
  family.series("relative_speed", speed, neither, relative_speed,
                "true speed of target against sensor");
}

}  // namespace berth::evaluation
