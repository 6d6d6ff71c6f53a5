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

/// By how much later than the arms' clocks say an estimate's pose was true: what it says of its
/// time t is where truth was at t less the delay. Truth's constant errors do not pretend to be a
/// delay: those of both mounts, a turn, and a change in proportion to the way gone are solved for
/// beside it, as uncertain beforehand as truth's covariance has them. So a target that goes to and
/// fro makes the delay observable; at constant velocity it is confounded with truth's bias.
///
/// The pose of a single scan is not quite its scan's alone: the estimator holds it back towards
/// what it expected, and moves the returns to one time with the velocity that it believed. Where
/// the target accelerates both lag, and a few tenths of that are worth a millisecond. How much of
/// both is in the poses is solved for, too; estimates with none before them are left out.
///
/// Estimates by which the arms were steered do not count: guidance goes after their errors, so that
/// the error makes the motion and not the motion the error.
EstimateDelay estimate_delay(const Measurer& measurer, const Phase& phase, EstimatePose which);

}  // namespace berth::evaluation
