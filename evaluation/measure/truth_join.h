// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "common/meshes/symmetry.h"
#include "evaluation/run/run_record.h"

namespace berth::evaluation {

struct TruthVelocity {
  Velocity velocity;                       ///< sensor frame
  Matrix6d covariance = Matrix6d::Zero();  ///< [m/s; rad/s]
};

/// Velocity about the time of a sample of truth. GROUND_TRUTH says it of the time just before, for
/// who must know it at once; here it is taken from the poses 50 ms before and after. Where there
/// are none, what the sample says. Its uncertainty: that of the frame's own rotation, and the noise
/// of the poses, which shows in how the velocities before and after differ. For independent noise s
/// of each pose and a half window h that difference has the variance 6 s^2/h^2 and the mean of both
/// s^2/(2 h^2), a twelfth; an acceleration counts as noise.
TruthVelocity truth_velocity(const TruthTrack& track, const TruthSample& truth);

/// An estimate (status OK) beside the truth at its own time.
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

/// The one place where an estimate meets truth. Nothing where truth does not bracket the time.
/// @param delay by which the estimate's stamp is taken to be late, us
std::optional<ComparedEstimate> compare(const EstimateSample& estimate, const TruthTrack& track,
                                        const SymmetryGroup& symmetry, Utime delay = 0);

}  // namespace berth::evaluation
