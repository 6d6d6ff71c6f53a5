// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "estimator/beam/scan.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Chi squared of six degrees of freedom that one in a million exceeds: a pose so far from where it
/// was expected is off for another reason than the expectation's error.
constexpr double one_in_a_million = 38.3;

/// What is known of the target before a scan is looked at. Sensor frame.
struct Prediction {
  Pose pose;            ///< T_sensor_model at the scan's mean time
  Matrix6d covariance;  ///< of pose, as berth::perturbed
  Velocity velocity;    ///< along which returns are moved to that time
  /// Of velocity, [linear; angular]. Zero: it is known.
  Matrix6d velocity_covariance = Matrix6d::Zero();
};

/// What one scan says of the pose.
struct TrackingResult {
  bool ok = false;
  std::string reason;  ///< why not
  Pose pose;           ///< T_sensor_model at the scan's mean time
  Matrix6d covariance = Matrix6d::Identity();
  /// What the returns alone say of pose and velocity, where the method knows.
  std::optional<MeasuredMotion> motion;
  /// What is left of the returns used, m: what the method minimises, put as a length (ICP: the rms
  /// distance along the normal; beams: the range noise times the rms of normalised residuals). The
  /// method chooses which returns fit: this is no measure of how right the pose is.
  double residual_rms = 0;
  /// Variance of the returns used over that of the beam model; 0: the method does not know.
  double spread = 0;
  int iterations = 0;
  int used = 0;           ///< returns that fit the target
  int near = 0;           ///< returns about the target: used, or beside it or before it
  double confidence = 0;  ///< 0..1: share of returns near the target that fit it, times share of
                          ///< beams predicted to meet it that did
};

/// Standard deviation of the target's farthest points, m. covariance: of its pose, as
/// berth::perturbed.
double uncertainty_of_ends(const TargetModel& model, const Matrix6d& covariance);

/// Empty, or why a measured pose is too far from the predicted one to be trusted: by the shift of
/// the model's centre (m) or by the turn (rad).
std::string why_too_far(const TargetModel& model, const Pose& predicted, const Pose& measured,
                        double max_shift_m, double max_turn_rad);

/// Measures the pose from one scan, starting from a prediction, and judges itself. const and
/// deterministic; the model, beam model and options that it was made from must outlive it.
class Tracking {
 public:
  virtual ~Tracking() = default;

  /// As configuration files and estimates name the method.
  virtual std::string name() const = 0;
  virtual TrackingResult track(const CleanScan& scan, const Prediction& predicted) const = 0;
};

}  // namespace berth::estimator
