// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/tracking/beam_approach.h"
#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/tracking.h"

namespace berth::estimator {

struct BeamTrackingOptions {
  BeamApproachOptions approach;
  BeamInformationOptions information;
  int approach_returns = 240;  ///< of a scan, from which the approach is made
  int settle_beams = 500;      ///< of a scan, on which the likelihood's steps begin
  int max_settle_steps = 6;
  bool deskew = true;  ///< each return is used at its own time
  // When the target counts as lost in this scan.
  int least_used = 20;
  double most_shift_m = 0.30;  ///< of the measured pose from the predicted one
  double most_turn_rad = radians(12);
  double least_explained = 0.6;  ///< share of the beams that should meet the target, and are not
                                 ///< stopped before it, that do
  double most_uncertain = 0.03;  ///< standard deviation of a point of the target, of its size
};

/// Measures the pose by the likelihood of the beams: each return tells of the face that its beam
/// meets, which holds on both sides of a thin panel and at its ends, where the nearest face may be
/// another. A coarse approach, then Gauss-Newton on few beams, then on all. The covariance is the
/// inverse of the information, no more and no less.
class BeamTracking final : public Tracking {
 public:
  BeamTracking(const TargetModel& model, const BeamModel& beam_model,
               const BeamTrackingOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  std::string name() const override { return "beam"; }
  TrackingResult track(const CleanScan& scan, const Prediction& predicted) const override;

 private:
  struct Fit {
    Pose pose;
    BeamInformation sums;  // at the pose before the last step
    Matrix6d covariance = Matrix6d::Identity();
    int steps = 0;
  };

  Fit fit(const CleanScan& scan, const Prediction& predicted, const Pose& start) const;
  std::string judge(const TrackingResult& result, const Fit& fit, const Pose& predicted) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const BeamTrackingOptions& options_;
};

}  // namespace berth::estimator
