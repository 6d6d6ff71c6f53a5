// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "estimator/plan/scan_planner.h"
#include "estimator/ranges/operating_range.h"

namespace berth::estimator {

/// A part of space about the target, model frame.
struct ModelSphere {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  ///< m
};

/// What is looked at when the whole target no longer fits in the field of view: a sphere about the
/// docking port of the options, or that which is nearest to the sensor. Nothing when the target has
/// none.
/// @param pose T_sensor_model
std::optional<ModelSphere> docking_region(const TargetModel& model, const RangeOptions& options,
                                          const Pose& pose);
/// @throws InputError where the options name a docking port that the target has not.
void require_port(const Target& target, const RangeOptions& options);

/// The window about a sphere in a pose, cut to the field of view. Nothing when none of it is in
/// view.
std::optional<Window> window_around(const ModelSphere& sphere, const Pose& pose,
                                    const FieldOfView& field, int beams, const std::string& name);

}  // namespace berth::estimator
