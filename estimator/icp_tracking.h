// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/beam_likelihood.h"
#include "estimator/icp.h"

namespace berth::estimator {

struct TrackingOptions {
  IcpOptions icp;
  int beam_steps = 0;               ///< after ICP, steps on the beams' range residuals
  bool deskew = true;               ///< move every return to the scan's mean time first
  std::size_t most_points = 60000;  ///< of a scan; more are thinned
  // When the target counts as lost in this scan.
  int least_used = 30;
  double least_inlier_share = 0.6;
  double most_residual_m = 0.04;
  double most_shift_m = 0.30;  ///< of the measured pose from the predicted one
  double most_turn_rad = radians(12);
  double least_explained = 0.6;  ///< share of the beams predicted to meet the target that do
  double most_through = 0.35;    ///< share of them that go through it
  // Covariance: from the measured spread of the ranges, never better than the beam model's noise.
  double covariance_scale = 1.0;  ///< of the variance
  double floor_m = 0.0005;
  double floor_rad = 0.0003;
  LikelihoodOptions likelihood;
};

struct TrackingResult {
  bool ok = false;
  std::string reason;  ///< why not
  Pose pose;           ///< T_sensor_model at the scan's mean time
  Matrix6d covariance = Matrix6d::Identity();
  IcpResult icp;
  Likelihood fit;
  double confidence = 0;  ///< 0..1: share of returns near the target that fit it, times share of
                          ///< beams predicted to meet it that did
};

/// Measures the pose from one scan, starting from a prediction (paper, section 4.4), and judges
/// itself: by inliers, residual, step, and by casting beams at the result.
class IcpTracking {
 public:
  IcpTracking(const TargetModel& model, const BeamModel& beam_model, const TrackingOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  /// predicted: pose at scan.utime_mean, with its covariance and velocity.
  TrackingResult track(const CleanScan& scan, const Pose& predicted, const Matrix6d& covariance,
                       const Velocity& velocity) const;

 private:
  std::vector<Vector3d> points_at_mean_time(const CleanScan& scan, const Pose& predicted,
                                            const Velocity& velocity) const;
  std::string judge(const TrackingResult& result, const Pose& predicted) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const TrackingOptions& options_;
};

}  // namespace berth::estimator
