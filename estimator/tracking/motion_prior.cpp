// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/motion_prior.h"

#include <Eigen/Cholesky>

namespace berth::estimator {

bool agree(const Pose& a, const Pose& b, const Matrix6d& covariance) {
  constexpr double most = 6;  // one for each degree of freedom
  const Vector6d apart = difference(a, b);
  return apart.dot(covariance.ldlt().solve(apart)) < most;
}

Vector12d newton_step(const Matrix12d& information, const Vector12d& gradient, bool of_velocity,
                      Matrix12d& covariance) {
  const Eigen::Index size = of_velocity ? 12 : 6;
  const MotionMatrix known = information.topLeftCorner(size, size);
  const MotionMatrix inverse = known.ldlt().solve(MotionMatrix::Identity(size, size));
  covariance.topLeftCorner(size, size) = 0.5 * (inverse + inverse.transpose());
  return covariance * gradient;
}

}  // namespace berth::estimator
