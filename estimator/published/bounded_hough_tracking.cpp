// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/bounded_hough_tracking.h"

#include "estimator/scan/at_mean_time.h"

namespace berth::estimator {

TrackingResult BoundedHoughTracking::track(const CleanScan& scan,
                                           const Prediction& predicted) const {
  Prediction voted = predicted;
  const CleanScan still = at_mean_time(scan, predicted.velocity, predicted.pose.position);
  voted.pose = hough_.vote(still.points, predicted.pose).pose;
  return refinement_.track(scan, voted);
}

}  // namespace berth::estimator
