// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth::evaluation {

/// A value and what truth's own uncertainty makes of it, 1 sigma.
struct Uncertain {
  double value;
  double truth_sigma;
};

/// Standard deviation of a vector's component along a direction; of a direction of no length, the
/// root of the trace.
double sigma_along(const Matrix3d& covariance, const Vector3d& direction);

/// Length of a vector. To first order its uncertainty is that along it; near zero the vector that
/// is really there may point anywhere, so that it is never less than what the whole covariance adds
/// to the length in the mean: sqrt(|v|^2 + tr C) - |v|.
Uncertain length_of(const Vector3d& vector, const Matrix3d& covariance);

/// Covariance of a point that moves with a pose, from the pose's covariance (left perturbation) and
/// the lever from the pose's origin to the point, outer frame.
Matrix3d point_covariance(const Matrix6d& pose_covariance, const Vector3d& lever);

/// Of a body's velocity in a frame whose own rotation is known with this covariance.
Matrix3d turned_covariance(const Vector3d& velocity, const Matrix3d& rotation_covariance);

}  // namespace berth::evaluation
