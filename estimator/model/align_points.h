// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "estimator/model/closest_point_grid.h"

namespace berth::estimator {

/// At most `max` of the points, evenly sampled from the list.
std::vector<Vector3d> sampled_evenly(std::span<const Vector3d> points, std::size_t max);

/// Point-to-surface registration: Gauss-Newton on the points' distances d from the visible surface,
/// with the weights 1 / (1 + (d / gate)^2)^2 of Geman and McClure; the gate (m) shrinks from
/// first_gate to last_gate. Directions that the surface leaves unobservable are regularised.
/// @param points in a frame about their own centre, m
/// @return T_model_points.
Pose align_points(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                  const Pose& to_model, double first_gate, double last_gate, int iterations);

}  // namespace berth::estimator
