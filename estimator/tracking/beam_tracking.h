// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/tracking/beam_approach.h"
#include "estimator/tracking/beam_descent.h"
#include "estimator/tracking/tracking.h"

namespace berth::estimator {

struct BeamTrackingOptions {
  BeamApproachOptions approach;
  int approach_returns = 120;  ///< of a scan, from which the approach is made
  BeamDescentOptions descent;
  bool deskew = true;  ///< each return is used at its own time
  /// A prediction that knows the target's farthest points better than this is a start, too.
  double most_uncertain_start_m = 0.03;
  /// Share of beams that contradict the pose (see BeamInformation): beyond it the search goes
  /// wider; where edges agree with faces, beyond twice that.
  double most_settled_contradiction = 0.01;
  /// So where faces leave the target's farthest points more uncertain than this.
  double most_open_m = 0.01;
  // When the target counts as lost in this scan.
  int least_used = 20;
  double most_contradiction = 0.4;  ///< share of beams, as above
  double most_chi2 = 3;             ///< per return that fits, of the beam model's variance
  double most_uncertain_m = 0.1;    ///< standard deviation of the target's farthest points
  double most_shift_m = 0.30;       ///< of the measured pose from the predicted one
  double most_turn_rad = radians(12);
};

/// Measures the pose by the likelihood of the beams: each return tells of the face that its beam
/// meets, which holds on both sides of a thin panel and at its ends, where the nearest face may be
/// another. A coarse approach, then Gauss-Newton on few beams, then on all; a pose that beams
/// contradict is searched for farther away. The covariance is the inverse of the information,
/// widened where the returns fit worse than the beam model says.
class BeamTracking final : public Tracking {
 public:
  BeamTracking(const TargetModel& model, const BeamModel& beam_model,
               const BeamTrackingOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  std::string name() const override { return "beam"; }
  TrackingResult track(const CleanScan& scan, const Prediction& predicted) const override;

 private:
  std::vector<Vector3d> sample(const CleanScan& scan, const Prediction& predicted) const;
  std::string judge(const TrackingResult& result, const BeamInformation& sums,
                    const Pose& predicted) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const BeamTrackingOptions& options_;
};

}  // namespace berth::estimator
