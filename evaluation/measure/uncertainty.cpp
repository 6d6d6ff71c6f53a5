// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/uncertainty.h"

#include <algorithm>
#include <cmath>

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

}  // namespace berth::evaluation
