// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth {

/// Point of the triangle abc nearest to p (Ericson, Real-Time Collision Detection, 5.1.5: regions
/// of Voronoi).
Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                             const Vector3d& c);

}  // namespace berth
