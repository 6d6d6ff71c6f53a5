// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "estimator/beam/scan.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Chi squared of six degrees of freedom with tail probability 1e-6: the gate of a pose about its
/// prediction.
constexpr double pose_chi_squared_limit = 38.3;

/// The prior of the target's motion for a scan. Sensor frame.
struct Prediction {
  Pose pose;            ///< T_sensor_model at the scan's mean time
  Matrix6d covariance;  ///< of pose, as berth::perturbed
  Velocity velocity;    ///< for motion compensation
  /// Of velocity, [linear; angular]. Zero: known.
  Matrix6d velocity_covariance = Matrix6d::Zero();
};

/// The measurement of the pose by one scan.
struct TrackingResult {
  bool ok = false;
  std::string reason;  ///< why not
  Pose pose;           ///< T_sensor_model at the scan's mean time
  Matrix6d covariance = Matrix6d::Identity();
  /// Measurement of pose and velocity by the returns alone, where the method provides it.
  std::optional<MeasuredMotion> motion;
  /// m, rms residual of the inliers (ICP: distance along the normal; likelihood: range noise times
  /// the rms normalised residual). Inliers are the method's choice: this does not measure the
  /// pose's error.
  double residual_rms = 0;
  /// Variance of the inliers' residuals over that of the beam model; 0: unknown.
  double spread = 0;
  int iterations = 0;
  int used = 0;           ///< inliers
  int near = 0;           ///< returns about the target: inliers and outliers
  double confidence = 0;  ///< 0..1: share of returns near the target that fit it, times share of
                          ///< predicted beams that returned from it
};

/// Standard deviation of the target's farthest points, m. covariance: of its pose, as
/// berth::perturbed.
double extremity_sigma(const TargetModel& model, const Matrix6d& covariance);

/// Empty, or why a measured pose is too far from the predicted one: by the shift of the model's
/// centre (m) or by the rotation (rad).
std::string prediction_mismatch(const TargetModel& model, const Pose& predicted,
                                const Pose& measured, double max_shift_m, double max_turn_rad);

/// Pose estimation from one scan and a prediction, with validation. const and deterministic; the
/// model, beam model and options must outlive it.
class Tracking {
 public:
  virtual ~Tracking() = default;

  /// Its name in configuration files and estimates.
  virtual std::string name() const = 0;
  virtual TrackingResult track(const PreprocessedScan& scan, const Prediction& predicted) const = 0;
};

}  // namespace berth::estimator
