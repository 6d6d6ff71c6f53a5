// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/beam_model.h"

namespace berth::estimator {

/// How far the noise may differ from what the scanner says of itself, as a factor on its sigmas.
/// Both 1: it is believed.
struct NoiseOptions {
  double min = 0.3;
  double max = 5;
};

/// The noise of the beams as the returns themselves show it: what the scanner says, times a factor
/// on its three sigmas. (Returns tell of the noise along the beam; that of the angles is taken to
/// differ likewise.)
class NoiseScale {
 public:
  NoiseScale(const BeamModel& said, const NoiseOptions& options);

  /// As it is believed now; the same object always.
  const BeamModel& beam() const { return beam_; }
  double factor() const { return factor_; }

  /// As the scanner says.
  void forget() { become(1, 0); }
  /// The factor that an acquisition needed to explain its scan.
  void start_at(double factor) { become(factor, 0); }
  /// Returns that fit a measured pose.
  /// @param spread their variance over that of beam(); 0: not known
  /// @return whether they are so far off that what was believed before is worth nothing.
  bool learn(double spread, int returns);

 private:
  void become(double learnt, double returns);

  BeamModel said_;
  NoiseOptions options_;
  BeamModel beam_;
  double learnt_ = 1;
  double factor_ = 1;   // so, but the scanner is believed while it is nearly right
  double returns_ = 0;  // that they rest on
};

}  // namespace berth::estimator
