// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/model/target_model.h"
#include "estimator/scan/scan.h"

namespace berth::estimator {

/// The model in a pose, as a LIDAR at the origin sees it, and what each return from it says of the
/// pose. The pose's six parameters are all lengths here: translation, and rotation vector times the
/// target's half length, both in the axes of the model, which changes no trace.
class PoseView {
 public:
  /// least_cosine: of the incidence; flatter beams are taken for misses.
  PoseView(const TargetModel& model, const BeamModel& beam, const Pose& pose, double least_cosine);

  /// For beams of these directions (unit, sensor axes) the derivative of the range by the
  /// parameters over the range's standard deviation: a return adds root * root^T to the Fisher
  /// information (1/m^2). Zero where none comes back. Several times faster where neighbours in the
  /// list are neighbours in space. roots: as many as directions.
  void roots(std::span<const Vector3d> directions, std::span<Vector6d> roots) const;

  /// Covariance of the pose as berth::perturbed (m, rad, sensor axes), from that of the parameters.
  Matrix6d pose_covariance(const Matrix6d& scaled) const;

 private:
  const TargetModel& model_;
  const BeamModel& beam_;
  Pose to_model_;
  Matrix3d rotation_;  // of to_model_
  double far_;
  double least_cosine_;
};

/// Directions (unit, sensor axes) of a window's beams, swept as a raster (as drivers/lidar does):
/// rows from the top, to and fro, each beam in the middle of a cell of its own. Appends
/// window.count.
void append_raster(const Window& window, std::vector<Vector3d>& directions);

/// Fisher information of the windows' beams together. returns: how many come back.
Matrix6d scan_information(const PoseView& view, const std::vector<Window>& windows,
                          int* returns = nullptr);

}  // namespace berth::estimator
