// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/estimator_options.h"

namespace berth::estimator {

/// A pose that may explain the scan, refined.
struct PoseCandidate {
  Pose pose;                           ///< T_sensor_model
  std::optional<Matrix6d> covariance;  ///< as berth::perturbed
  double probability = 0;
  std::optional<double> log_likelihood;  ///< as acquisition gave it
  int equal_poses = 1;                   ///< that a symmetry of the target makes one and the same
  int used = 0;                          ///< returns that fit the target
};

struct SingleScanResult {
  enum class Status { ok, ambiguous, lost };
  Status status = Status::lost;
  std::string reason;                     ///< empty when ok
  std::vector<std::string> notes;         ///< what else a user should know
  std::vector<PoseCandidate> candidates;  ///< best first; one when ok; what was left when lost
  bool acquired = false;  ///< by acquisition; otherwise tracked from the initial pose
  std::int64_t acquire_us = 0;
  std::int64_t refine_us = 0;
};

/// "ok", "ambiguous" or "lost".
const char* name_of(SingleScanResult::Status status);

/// The length at which models are compiled for SingleScan: the replica's, whose size the lengths in
/// the options are meant for.
constexpr double reference_length_m = 3;

/// 1 sigma of a pose to start from: of the target's radius, and rad.
struct StartSigma {
  double of_radius, rad;
};

/// The pose of the target in one scan that stands alone: acquisition, or an initial pose, then
/// tracking as refinement, then verification. const and deterministic. Model and options must
/// outlive it.
class SingleScan {
 public:
  /// scale: how many times larger the target is than its model. The scan is shrunk by it, the
  /// result enlarged, so that any size is served alike. beam_model: of the sensor, not scaled.
  /// stopwatch: us, for the durations in the result; without one they are 0.
  SingleScan(const TargetModel& model, double scale, const EstimatorOptions& options,
             const BeamModel& beam_model, std::function<std::int64_t()> stopwatch = {});

  /// No input is an error: the reason says what a scan lacks. An initial pose (T_sensor_model) is
  /// tracked from; when that loses the target, it is acquired as if there were none, with a note.
  SingleScanResult estimate(const CleanScan& scan, const std::optional<Pose>& initial = {}) const;

  std::string acquisition_method() const { return acquisition_->name(); }
  std::string tracking_method() const { return tracking_->name(); }

 private:
  SingleScanResult estimate_scaled(const CleanScan& scan, const std::optional<Pose>& initial) const;
  bool track_initial(const CleanScan& scan, const Pose& initial, SingleScanResult& result) const;
  void acquire(const CleanScan& scan, SingleScanResult& result) const;
  /// doubts: why it cannot be the target, else empty.
  PoseCandidate refined(const CleanScan& scan, const Pose& start, const StartSigma& sigma,
                        std::string& doubts) const;
  void refine(const CleanScan& scan, const AcquisitionResult& found,
              SingleScanResult& result) const;
  /// Looks for another target among the returns that the one found does not explain: an occluder
  /// may pass for it.
  void look_again(const CleanScan& scan, SingleScanResult& result) const;
  bool same_pose(const Pose& a, const Pose& b) const;
  std::int64_t now() const { return stopwatch_ ? stopwatch_() : 0; }

  const TargetModel& model_;
  double scale_;
  BeamModel beam_model_;  ///< scaled
  std::function<std::int64_t()> stopwatch_;
  std::unique_ptr<Acquisition> acquisition_;
  std::unique_ptr<Tracking> tracking_;
};

/// The beam model for data whose sensor is unknown: the same noise, no limits of range but what
/// arithmetic can bear.
BeamModel without_range_limits(BeamModel beam_model);

}  // namespace berth::estimator
