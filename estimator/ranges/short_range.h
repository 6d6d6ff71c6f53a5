// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "estimator/planning/scan_planner.h"

namespace berth::estimator {

/// A part of space about the target, model frame.
struct ModelSphere {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  ///< m
};

/// What is looked at when the whole target no longer fits in the field of view: a sphere about the
/// docking port that is nearest to the sensor. Nothing when the target has none.
/// @param share the radius, of the target's length
/// @param pose T_sensor_model
std::optional<ModelSphere> docking_region(const TargetModel& model, double share, const Pose& pose);

/// The window about a sphere in a pose, cut to the field of view. Nothing when none of it is in
/// view.
std::optional<Window> window_around(const ModelSphere& sphere, const Pose& pose,
                                    const FieldOfView& field, int beams, const std::string& name);

}  // namespace berth::estimator
