// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/run/truth_track.h"

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

}  // namespace berth::evaluation
