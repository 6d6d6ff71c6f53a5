// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/beam/noise_scale.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

NoiseScale::NoiseScale(const BeamModel& nominal, const NoiseOptions& options)
    : nominal_(nominal), options_(options), beam_(nominal) {
  reset();
}

void NoiseScale::set(double learnt, double returns) {
  constexpr double dead_band = 1.15;  // mixed pixels and mesh errors scatter as much
  learnt_ = std::clamp(learnt, options_.min, options_.max);
  factor_ = learnt_ > 1 / dead_band && learnt_ < dead_band ? 1 : learnt_;
  returns_ = returns;
  beam_.range_sigma_m = factor_ * nominal_.range_sigma_m;
  beam_.azimuth_sigma_rad = factor_ * nominal_.azimuth_sigma_rad;
  beam_.elevation_sigma_rad = factor_ * nominal_.elevation_sigma_rad;
}

bool NoiseScale::update(double spread, int returns) {
  constexpr double max_returns = 5000;   // some five scans: the noise varies with illumination
  constexpr double prior_returns = 200;  // weight of the specification
  constexpr double max_ratio = 2;  // of variances, or its inverse: improbable for a hundred returns
  constexpr int min_returns = 100;
  if (!(spread > 0) || returns <= 0) return false;
  const double before = factor_;
  const bool jump = returns >= min_returns && (spread > max_ratio || spread < 1 / max_ratio);
  const double prior = jump ? 0 : std::max(prior_returns, returns_);
  const double observed = spread * factor_ * factor_;
  const double variance = (prior * learnt_ * learnt_ + returns * observed) / (prior + returns);
  set(std::sqrt(variance), std::min(max_returns, prior + returns));
  return jump && factor_ != before;
}

}  // namespace berth::estimator
