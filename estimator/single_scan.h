// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/estimator_options.h"

namespace berth::estimator {

/// A refined candidate pose.
struct PoseCandidate {
  Pose pose;                           ///< T_sensor_model
  std::optional<Matrix6d> covariance;  ///< as berth::perturbed
  double probability = 0;
  std::optional<double> log_likelihood;  ///< by acquisition
  int equal_poses = 1;                   ///< number of poses equal under the target's symmetries
  int used = 0;                          ///< inliers
};

struct SingleScanResult {
  enum class Status { ok, ambiguous, lost };
  Status status = Status::lost;
  std::string reason;                     ///< empty when ok
  std::vector<std::string> notes;         ///< further remarks for the user
  std::vector<PoseCandidate> candidates;  ///< by descending probability; one when ok
  bool acquired = false;                  ///< by acquisition; else tracked from the initial pose
  std::int64_t acquire_us = 0;
  std::int64_t refine_us = 0;
};

/// "ok", "ambiguous" or "lost".
const char* name_of(SingleScanResult::Status status);

/// Target length at which models are compiled for SingleScan: the replica's, for which lengths in
/// the options are meant.
constexpr double reference_length_m = 3;

/// 1 sigma of an initial pose: translation over the target's radius, and rad.
struct StartSigma {
  double of_radius, rad;
};

/// The target's pose in a single scan: acquisition or an initial pose, refinement by tracking, then
/// validation. const and deterministic. Model and options must outlive it.
class SingleScan {
 public:
  /// @param scale of the target over its model: the scan is scaled by 1 / scale, the result back
  /// @param beam_model of the sensor, not scaled
  /// @param stopwatch us, for durations in the result; else they are 0
  SingleScan(const TargetModel& model, double scale, const EstimatorOptions& options,
             const BeamModel& beam_model, std::function<std::int64_t()> stopwatch = {});

  /// Any input is valid; the reason names what a scan lacks. An initial pose (T_sensor_model) is
  /// tracked from; where that loses the target, it is acquired, with a note.
  SingleScanResult estimate(const PreprocessedScan& scan,
                            const std::optional<Pose>& initial = {}) const;

  std::string acquisition_method() const { return acquisition_->name(); }
  std::string tracking_method() const { return tracking_->name(); }

 private:
  SingleScanResult estimate_scaled(const PreprocessedScan& scan,
                                   const std::optional<Pose>& initial) const;
  bool track_initial(const PreprocessedScan& scan, const Pose& initial,
                     SingleScanResult& result) const;
  void acquire(const PreprocessedScan& scan, SingleScanResult& result) const;
  /// failure: set to why the candidate fails validation, or empty.
  PoseCandidate refined(const PreprocessedScan& scan, const Pose& start, const StartSigma& sigma,
                        std::string& failure) const;
  void refine(const PreprocessedScan& scan, const AcquisitionResult& found,
              SingleScanResult& result) const;
  /// Searches the returns that the found target does not explain for another one: an occluder may
  /// be mistaken for the target.
  void search_remaining(const PreprocessedScan& scan, SingleScanResult& result) const;
  bool same_pose(const Pose& a, const Pose& b) const;
  std::int64_t now() const { return stopwatch_ ? stopwatch_() : 0; }

  const TargetModel& model_;
  double scale_;
  BeamModel beam_model_;  ///< scaled
  std::function<std::int64_t()> stopwatch_;
  std::unique_ptr<Acquisition> acquisition_;
  std::unique_ptr<Tracking> tracking_;
};

/// The beam model for data of an unknown sensor: the same noise without limits of range.
BeamModel without_range_limits(BeamModel beam_model);

}  // namespace berth::estimator
