// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/trials/world.h"

namespace berth::benchmark {

using namespace trials;

/// Root of the trace of the pose's covariance, rotations times a lever, m.
double rms_bound(const Matrix6d& information, double lever);

/// rms_bound of the best choice of `rays` single rays, found by adding the best one after the
/// other and then exchanging the worst for a better one while that helps (A-optimality). Rays are
/// those of a dense raster around the target that meet it less than flatly (cosine of the incidence
/// at least min_cosine); each is taken at most max_repeats times.
double optimal_rms_bound(const World& world, const Window& window, const Pose& pose, int rays,
                         double lever, double min_cosine, int max_repeats);

}  // namespace berth::benchmark
