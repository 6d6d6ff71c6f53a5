// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/model/target_model.h"
#include "estimator/published/beam_registration.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

enum class Registration {
  point_to_point,  ///< closed form over point pairs, as the paper
  point_to_plane,  ///< linearised over tangent planes
};

struct IcpOptions {
  Registration registration = Registration::point_to_point;
  bool refine_closest_points = true;  ///< exact on the stored triangle, not the stored point
  int max_iterations = 60;
  double start_gate_m = 0.15;  ///< initial outlier distance of a pair
  double min_gate_m = 0.035;   ///< its minimum
  double gate_sigmas = 3.0;    ///< between: robust standard deviations of the pairs' distances
  double stop_translation_m = 2e-5;  ///< an iteration below both ends the registration
  double stop_rotation_rad = 1e-5;
};

struct IcpResult {
  Pose pose;  ///< T_sensor_model
  Matrix6d information =
      Matrix6d::Zero();     ///< of the matches for unit variance, as berth::perturbed
  double residual_rms = 0;  ///< of the pairs used, along the normal, m
  int iterations = 0;
  int used = 0;  ///< pairs inside the gate
  int near = 0;  ///< points about the target: inliers, and outliers not behind it
  bool converged = false;
  bool constrained = false;  ///< the matches determine all six degrees of freedom

  double inlier_share() const { return near > 0 ? static_cast<double>(used) / near : 0; }
};

/// Iterative closest points of a cloud to the model (paper, section 4.4): precomputed closest
/// points, an adaptive outlier gate, registration, to convergence. points: sensor frame, m.
IcpResult align(const TargetModel& model, const std::vector<Vector3d>& points, const Pose& start,
                const IcpOptions& options);

/// Options of IcpTracking.
struct IcpTrackingOptions {
  IcpOptions icp;
  int beam_steps = 0;              ///< Gauss-Newton steps on range residuals after ICP
  bool deskew = true;              ///< compensate motion to the scan's mean time first
  std::size_t max_points = 60000;  ///< of a scan; more are thinned
  // Limits of validation.
  int min_used = 30;
  double min_inlier_share = 0.6;
  double max_residual_m = 0.04;
  double max_shift_m = 0.30;  ///< of the measured pose from the predicted one
  double max_turn_rad = radians(12);
  double min_explained = 0.6;  ///< share of the beams predicted to meet the target that do
  double max_through = 0.35;   ///< share of them that pass through it
  // Covariance: by the measured scatter of ranges, at least the beam model's noise.
  double covariance_scale = 1.0;  ///< of the variance
  double floor_m = 0.0005;
  double floor_rad = 0.0003;
  LikelihoodOptions likelihood;
};

/// Tracking by ICP from a prediction (paper, section 4.4), validated by inliers, residual, distance
/// from the prediction, and beams cast at the result.
class IcpTracking final : public Tracking {
 public:
  IcpTracking(const TargetModel& model, const BeamModel& beam_model,
              const IcpTrackingOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  /// "icp point_to_point" or "icp point_to_plane".
  std::string name() const override;
  TrackingResult track(const PreprocessedScan& scan, const Prediction& predicted) const override;

 private:
  std::vector<Vector3d> points_of(const PreprocessedScan& still) const;
  std::string judge(const TrackingResult& result, const IcpResult& icp, const Likelihood& fit,
                    const Pose& predicted) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const IcpTrackingOptions& options_;
};

}  // namespace berth::estimator
