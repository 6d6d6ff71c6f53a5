// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/model/target_model.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

/// Moments of the surface visible from one direction, as sampled by evenly spread beams. Model
/// frame, m.
struct ViewMoments {
  Vector3d to_viewer = Vector3d::UnitZ();  ///< unit
  Vector3d centroid = Vector3d::Zero();
  Matrix3d scatter = Matrix3d::Zero();  ///< about the centroid, m^2
};

/// Position and coarse attitude of a target too far for its pose (paper, section 3.1: bearing and
/// range).
struct LongRangeFix {
  bool ok = false;
  std::string reason;  ///< why not
  /// Position: the returns' centroid, corrected by the visible surface's centroid in the model
  /// frame. Attitude: the most probable, or the predicted one.
  Pose pose;
  /// Of this scan's independent errors; the rotation is not measured: variance of a half turn.
  Matrix6d covariance = Matrix6d::Identity();
  /// Covariance of errors constant while the attitude is unknown. Of pose, as berth::perturbed.
  Matrix6d systematic = Matrix6d::Zero();
  bool axis = false;  ///< the moments of the returns determined the attitude
  int used = 0;       ///< returns of the target
};

/// Bearing and range from the centroid of the returns; with about a hundred returns, their second
/// moments are compared with those of the model's views for a coarse axis. const and deterministic;
/// the model must outlive it.
class LongRange {
 public:
  LongRange(const TargetModel& model, const BeamModel& beam_model, int axis_returns);

  /// The target anywhere in the scan: the densest region of the target's size.
  LongRangeFix find(const PreprocessedScan& scan) const;
  /// The target at its prediction, whose attitude is a prior where known.
  LongRangeFix track(const PreprocessedScan& scan, const Prediction& predicted) const;

 private:
  LongRangeFix fix(const std::vector<Vector3d>& returns, const Prediction* predicted) const;
  /// A sampled attitude (view and roll about the line of sight) and its posterior weight.
  struct Attitude {
    Quaterniond rotation;  // R_sensor_model
    Vector3d centroid;     // of the visible surface, sensor axes, from the model's origin
    double weight = 0;
  };
  std::vector<Attitude> attitudes(const Vector3d& line_of_sight, const Matrix3d& scatter, int count,
                                  double range, const Prediction* predicted) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  int axis_returns_;
  std::vector<ViewMoments> views_;
};

}  // namespace berth::estimator
