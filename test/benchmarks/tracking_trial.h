// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/plan/scan_planner.h"
#include "test/benchmarks/cramer_rao.h"
#include "test/benchmarks/settings.h"

namespace berth::benchmark {

/// What a tracking trial is made from.
struct TrackingCase {
  Physics physics;
  estimator::ScanStrategy strategy = estimator::ScanStrategy::sparse;
  bool whole_target = false;  ///< one raster over all of the target instead of planned windows
  int returns = 1000;
  double start_m = 0.030;  ///< how far off the prediction is
  double start_rad = radians(2);
  double around_m = 0.1;  ///< the paper's pose, the truth lies
  double around_rad = radians(15);
};

struct TrackingTrial {
  Scan scan;
  Pose truth;
  estimator::Prediction predicted;
  Bound bound;
};

/// The paper's pose (Figure 8).
Pose paper_pose();
/// A pose at most this far away: position in a ball, attitude by less than so much about any axis.
Pose pose_around(const Pose& pose, double distance, double angle, Random& random);
/// A pose exactly this far away.
Pose pose_off(const Pose& pose, double distance, double angle, Random& random);

/// One scan from a pose around the paper's, its windows planned for a prediction that is off.
TrackingTrial make_tracking_trial(const estimator::TargetModel& model, const TrackingCase& the_case,
                                  Random random);

/// What a method made of a trial.
struct TrackingOutcome {
  bool ok = false;
  Vector6d error = Vector6d::Zero();  ///< from truth, as berth::difference
  double nees = 0;                    ///< normalised estimation error squared
  Bound bound;
  double cpu_ms = 0;
  double residual_rms = 0;
  int returns = 0;

  double translation() const { return error.head<3>().norm(); }
  double rotation() const { return error.tail<3>().norm(); }
};
TrackingOutcome track(const estimator::Tracking& method, const BeamModel& noise,
                      const TrackingTrial& trial);

}  // namespace berth::benchmark
