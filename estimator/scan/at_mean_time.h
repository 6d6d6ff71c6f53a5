// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

/// A scan of a target that moves with this velocity about its origin (m, sensor frame), as if all
/// of it had been seen at the scan's mean time: returns, and beams that met nothing as far as the
/// origin is. For methods that take a scan to be of one time.
CleanScan at_mean_time(const CleanScan& scan, const Velocity& velocity, const Vector3d& origin);

}  // namespace berth::estimator
