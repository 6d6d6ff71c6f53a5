// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>

#include "common/core/pose.h"
#include "common/meshes/symmetry.h"
#include "evaluation/run/run_record.h"

namespace berth::evaluation {

/// A value and its 1 sigma from the covariance of truth.
struct Uncertain {
  double value;
  double truth_sigma;
};

/// Standard deviation of a vector's component along a direction; of a direction of no length, the
/// root of the trace.
double sigma_along(const Matrix3d& covariance, const Vector3d& direction);

/// Length of a vector. To first order its uncertainty is that along it; near zero the true vector
/// may point in any direction, so that it is never less than the mean contribution of the whole
/// covariance to the length: sqrt(|v|^2 + tr C) - |v|.
Uncertain length_of(const Vector3d& vector, const Matrix3d& covariance);

/// Covariance of a point that moves with a pose, from the pose's covariance (left perturbation) and
/// the lever from the pose's origin to the point, outer frame.
Matrix3d point_covariance(const Matrix6d& pose_covariance, const Vector3d& lever);

/// Of a body's velocity in a frame whose own rotation is known with this covariance.
Matrix3d turned_covariance(const Vector3d& velocity, const Matrix3d& rotation_covariance);

struct TruthVelocity {
  Velocity velocity;                       ///< sensor frame
  Matrix6d covariance = Matrix6d::Zero();  ///< [m/s; rad/s]
};

/// Velocity at the time of a sample of truth: central difference of the poses 50 ms before and
/// after. (GROUND_TRUTH has that of the time just before, for use without delay.) Where there are
/// none, that of the sample. Its uncertainty: that of the frame's own rotation, and the noise
/// of the poses, which shows in how the velocities before and after differ. For independent noise s
/// of each pose and a half window h that difference has the variance 6 s^2/h^2 and the mean of both
/// s^2/(2 h^2), a twelfth; an acceleration counts as noise.
TruthVelocity truth_velocity(const TruthTrack& track, const TruthSample& truth);

/// An estimate (status OK) and truth at its time.
struct ComparedEstimate {
  EstimateSample estimate;  ///< as the target's symmetry brings it nearest to truth: its poses,
                            ///< velocity and covariance
  TruthSample truth;        ///< its velocity is that about the time of the estimate, not before it
  Vector6d error;           ///< perturbed(truth, error) = estimate: [m; rad], sensor frame
  /// Of truth's velocity, [m/s; rad/s], sensor frame.
  Matrix6d truth_velocity_covariance = Matrix6d::Zero();

  /// As error, of the scan alone.
  Vector6d measured_error() const { return difference(truth.pose, estimate.measured); }
};

/// The join of an estimate with truth. Nothing where truth does not bracket the time.
/// @param delay by which the estimate's stamp is taken to be late, us
std::optional<ComparedEstimate> compare(const EstimateSample& estimate, const TruthTrack& track,
                                        const SymmetryGroup& symmetry, Utime delay = 0);

/// The error of the latest estimate that truth has caught up with, while a run goes on. One thread.
class LiveError {
 public:
  void on(const run_info_t& message);
  /// One of status OK.
  void on(const pose_estimate_t& message);
  void on(const ground_truth_t& message);

  /// Of the last 10 s or more.
  const TruthTrack& truth() const { return truth_; }
  /// Nothing before the first.
  const std::optional<ComparedEstimate>& latest() const { return latest_; }

 private:
  SymmetryGroup symmetry_;  // of the run's target
  TruthTrack truth_;
  std::deque<EstimateSample> waiting_;  // for truth
  std::optional<ComparedEstimate> latest_;
};

}  // namespace berth::evaluation
