// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/model/target_model.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

/// What evenly spread beams from one direction see of a target: where, and how it is spread. Model
/// frame, m.
struct ViewMoments {
  Vector3d to_viewer = Vector3d::UnitZ();  ///< unit
  Vector3d centroid = Vector3d::Zero();
  Matrix3d scatter = Matrix3d::Zero();  ///< about the centroid, m^2
};

/// What can be said of a target that is too far for its pose (paper, section 3.1: bearing and
/// range).
struct LongRangeFix {
  bool ok = false;
  std::string reason;  ///< why not
  /// Position: the returns' centroid, corrected by how far the seen surface lies from the model's
  /// origin. Attitude: the likeliest, or the predicted one where nothing is known.
  Pose pose;
  /// Of this scan's own, independent errors; in rotation nothing is measured: as good as infinite.
  Matrix6d covariance = Matrix6d::Identity();
  /// What stays the same in every scan as long as the attitude is not known: it does not average
  /// out. Of pose, as berth::perturbed.
  Matrix6d systematic = Matrix6d::Zero();
  bool axis = false;  ///< the returns were enough for their moments to tell of the attitude
  int used = 0;       ///< returns of the target
};

/// Bearing and range from the centroid of the returns; with about a hundred of them, their moments
/// against those of the model from every side give a coarse axis. const and deterministic; the
/// model must outlive it.
class LongRange {
 public:
  LongRange(const TargetModel& model, const BeamModel& beam_model, int axis_returns);

  /// The target anywhere in the scan: the densest place of the size of the target.
  LongRangeFix find(const CleanScan& scan) const;
  /// The target where it is predicted to be. A prediction whose attitude is known weighs in.
  LongRangeFix track(const CleanScan& scan, const Prediction& predicted) const;

 private:
  LongRangeFix fix(const std::vector<Vector3d>& returns, const Prediction* predicted) const;
  /// Poses' share of belief: view and roll about the line of sight.
  struct Attitude {
    Quaterniond rotation;  // R_sensor_model
    Vector3d centroid;     // of what is seen, sensor axes, from the model's origin
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
