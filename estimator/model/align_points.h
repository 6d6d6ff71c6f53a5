// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "estimator/model/closest_point_grid.h"

namespace berth::estimator {

/// Lays points on the visible surface: Gauss-Newton on their distances from it, which beyond the
/// gate (m, shrinking from first to last) count less and less. points: in a frame about their own
/// centre, m. @return T_model_points.
Pose lay_points(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                const Pose& to_model, double first_gate, double last_gate, int iterations);

}  // namespace berth::estimator
