// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/latency/delay_fit.h"
#include "evaluation/measure/measurer.h"

namespace berth::evaluation {

/// Which pose of an estimate.
enum class EstimatePose {
  measured,  ///< by its scan alone
  filtered   ///< what guidance flies by; a filter may lag behind
};

struct EstimateDelay {
  DelayFit fit;
  double speed = 0;          ///< rms of the target's, m/s
  double angular_speed = 0;  ///< rad/s
  /// Empty when observable; else the motion that would make it observable.
  std::string not_observable;
};

/// A half-width above this counts as not observable: an uncalibrated cell is no further off.
inline constexpr double widest_delay_interval = 0.020;  // s

/// Time offset between an estimate's stamp and ground truth: the pose at stamp t equals truth at t
/// less the delay. Truth's constant errors are estimated along with it, with truth's covariance as
/// their prior: offsets of both mounts, a rotation, and an error in proportion to the displacement.
/// Observable under reciprocating motion; at constant velocity confounded with these errors.
///
/// The pose of a single scan also depends on the estimator's prior: it is drawn towards the
/// prediction, and returns are brought to one time with the estimated velocity. Where the target
/// accelerates both lag, by about a millisecond per few tenths of share. Both shares are estimated,
/// too; estimates without a previous one are left out.
///
/// Estimates by which the arms were steered do not count: guidance reduces their errors, so that
/// the error causes the motion and not the motion the error.
EstimateDelay estimate_delay(const Measurer& measurer, const Phase& phase, EstimatePose which);

}  // namespace berth::evaluation
