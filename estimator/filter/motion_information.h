// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "common/core/pose.h"

namespace berth::estimator {

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

/// The target's motion at one time: pose T_sensor_model and velocity, sensor frame.
struct Motion {
  Pose pose;
  Velocity velocity;
};

/// By d = [translation; rotation vector (as berth::perturbed); linear; angular velocity].
Motion perturbed(const Motion& motion, const Vector12d& d);
/// The d of perturbed() that leads from one to the other.
Vector12d difference(const Motion& from, const Motion& to);

/// What a batch of returns says of the motion at a reference time: their log-likelihood to second
/// order about a linearisation point, log L(d) = gradient.d - d.information.d / 2, in the d of
/// perturbed().
struct MotionInformation {
  Matrix12d information = Matrix12d::Zero();
  Vector12d gradient = Vector12d::Zero();
  int returns = 0;  ///< that said something
};

/// What the returns of one time say of the motion then, and about which motion that is linearised.
struct MeasuredMotion {
  Motion about;
  MotionInformation said;
  /// Of the covariance of said.gradient at the true motion, which is said.information, the part of
  /// errors that the next scan has, too: of the surface, of the range's bias. Zero: none.
  Matrix12d systematic = Matrix12d::Zero();
};

}  // namespace berth::estimator
