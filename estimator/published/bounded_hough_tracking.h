// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/published/bounded_hough.h"
#include "estimator/published/icp_tracking.h"

namespace berth::estimator {

/// Tracking by votes: the Bounded Hough Transform finds the pose to about half of its finest voxel,
/// point registration from there refines and judges it.
class BoundedHoughTracking final : public Tracking {
 public:
  BoundedHoughTracking(const TargetModel& model, const BeamModel& beam_model,
                       const BoundedHoughOptions& options, const IcpTrackingOptions& refinement)
      : hough_(model, options), refinement_(model, beam_model, refinement) {}

  std::string name() const override { return "bounded_hough"; }
  TrackingResult track(const CleanScan& scan, const Prediction& predicted) const override;

 private:
  BoundedHough hough_;
  IcpTracking refinement_;
};

}  // namespace berth::estimator
