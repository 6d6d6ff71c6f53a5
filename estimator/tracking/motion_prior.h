// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/filter/motion_information.h"

namespace berth::estimator {

/// Of pose, or of pose and velocity. Without the heap.
using MotionMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12>;

/// What is known of where a descent comes to is taken for so much less, in variance: some faces may
/// have been mistaken.
inline constexpr double looseness = 8;

/// Whether two poses differ no more than one of this covariance does from the truth, on average.
bool agree(const Pose& a, const Pose& b, const Matrix6d& covariance);

/// Gauss-Newton: of the pose alone, or of the velocity, too. covariance: becomes the information's
/// inverse; what is of no interest stays.
Vector12d newton_step(const Matrix12d& information, const Vector12d& gradient, bool of_velocity,
                      Matrix12d& covariance);

/// What is known of a motion before a scan's beams.
struct MotionPrior {
  Motion about;
  Matrix12d information = Matrix12d::Zero();
  bool of_velocity = false;  ///< whether that is estimated, too

  /// Moving as is supposed.
  Motion at(const Pose& pose) const { return {pose, about.velocity}; }
  /// Gradient of its log-likelihood.
  Vector12d pull(const Motion& from) const { return information * difference(from, about); }
};

}  // namespace berth::estimator
