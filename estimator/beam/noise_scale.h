// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/beam_model.h"

namespace berth::estimator {

/// Limits of the factor on the scanner's specified sigmas. Both 1: the specification is used as it
/// is.
struct NoiseOptions {
  double min = 0.3;
  double max = 5;
};

/// Scale of the scanner's noise, estimated from residuals: a factor on the three sigmas of its
/// specification. Residuals determine the noise along the beam; the angular noise is assumed to
/// scale alike. The estimate is a variance averaged over returns, with 200 returns of the
/// specification as prior and a memory of 5000 returns.
class NoiseScale {
 public:
  NoiseScale(const BeamModel& nominal, const NoiseOptions& options);

  /// The specification times the current factor; always the same object.
  const BeamModel& beam() const { return beam_; }
  double factor() const { return factor_; }

  /// Back to the specification.
  void reset() { set(1, 0); }
  /// From the factor that an acquisition estimated.
  void start_at(double factor) { set(factor, 0); }
  /// Updates with returns that fit a measured pose.
  /// @param spread variance of their residuals over that of beam(); 0: unknown
  /// @return whether the variance differs so much that the earlier estimate was discarded.
  bool update(double spread, int returns);

 private:
  void set(double learnt, double returns);

  BeamModel nominal_;
  NoiseOptions options_;
  BeamModel beam_;
  double learnt_ = 1;
  double factor_ = 1;   // 1 while the estimate is within the dead band about the specification
  double returns_ = 0;  // weight of the estimate
};

}  // namespace berth::estimator
