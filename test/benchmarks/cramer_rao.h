// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/trials/world.h"

namespace berth::benchmark {

using namespace trials;

/// Fisher information about the pose (perturbation as berth::perturbed) of a scan's returns, each
/// seen on the plane of the face that it truly hit. Hits and misses at edges would add a little.
Matrix6d fisher_information(const Scan& scan, const Pose& pose, const BeamModel& noise);
/// That of one return. direction: as commanded.
Matrix6d fisher_information(const Vector3d& direction, const TrueFace& face, const Pose& pose,
                            const BeamModel& noise);

/// The minimum root mean square errors of an unbiased estimator.
struct Bound {
  double translation = 0;  ///< m, of the position as a vector
  double rotation = 0;     ///< rad, likewise
  bool exists = false;     ///< the returns determine all six degrees of freedom
};
Bound cramer_rao_bound(const Matrix6d& information);

}  // namespace berth::benchmark
