// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

enum class Registration {
  point_to_point,  ///< closed form over point pairs, as the paper
  point_to_plane,  ///< linearised over tangent planes
};

struct IcpOptions {
  Registration registration = Registration::point_to_point;
  bool refine_closest_points = true;  ///< exact on the stored triangle, not the stored point
  int max_iterations = 60;
  double start_gate_m = 0.15;        ///< distance beyond which a pair is an outlier, at first
  double min_gate_m = 0.035;         ///< and at last
  double gate_sigmas = 3.0;          ///< between them: so many robust standard deviations
  double stop_translation_m = 2e-5;  ///< an iteration that moves less than both ends it
  double stop_rotation_rad = 1e-5;
};

struct IcpResult {
  Pose pose;  ///< T_sensor_model
  Matrix6d information =
      Matrix6d::Zero();     ///< of the matches for unit variance, as berth::perturbed
  double residual_rms = 0;  ///< of the pairs used, along the normal, m
  int iterations = 0;
  int used = 0;  ///< pairs inside the gate
  int near = 0;  ///< points about the target: used, or beside it or before it
  bool converged = false;
  bool constrained = false;  ///< the matches determine all six degrees of freedom

  double inlier_share() const { return near > 0 ? static_cast<double>(used) / near : 0; }
};

/// Iterative closest points between a cloud and the model (paper, section 4.4): precomputed closest
/// points, an adaptive gate for outliers, registration, until the pose rests. points: sensor frame,
/// m.
IcpResult align(const TargetModel& model, const std::vector<Vector3d>& points, const Pose& start,
                const IcpOptions& options);

}  // namespace berth::estimator
