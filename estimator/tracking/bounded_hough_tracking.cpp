// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/bounded_hough_tracking.h"

namespace berth::estimator {

TrackingResult BoundedHoughTracking::track(const CleanScan& scan,
                                           const Prediction& predicted) const {
  Prediction voted = predicted;
  voted.pose = hough_.vote(refinement_.points_at_mean_time(scan, predicted), predicted.pose).pose;
  return refinement_.track(scan, voted);
}

}  // namespace berth::estimator
