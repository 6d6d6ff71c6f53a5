// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/beam/noise_scale.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

NoiseScale::NoiseScale(const BeamModel& said, const NoiseOptions& options)
    : said_(said), options_(options), beam_(said) {
  forget();
}

void NoiseScale::become(double learnt, double returns) {
  constexpr double nearly = 1.15;  // beams at edges and a mesh not quite right do that, too
  learnt_ = std::clamp(learnt, options_.min, options_.max);
  factor_ = learnt_ > 1 / nearly && learnt_ < nearly ? 1 : learnt_;
  returns_ = returns;
  beam_.range_sigma_m = factor_ * said_.range_sigma_m;
  beam_.azimuth_sigma_rad = factor_ * said_.azimuth_sigma_rad;
  beam_.elevation_sigma_rad = factor_ * said_.elevation_sigma_rad;
}

bool NoiseScale::learn(double spread, int returns) {
  constexpr double max_remembered = 5000;  // returns, some five scans: noise changes with the light
  constexpr double as_said = 200;          // returns' worth of what was believed at first
  constexpr double no_chance = 2;          // or a half: the variance of a hundred returns never
  constexpr int min_returns = 100;
  if (!(spread > 0) || returns <= 0) return false;
  const double before = factor_;
  const bool jump = returns >= min_returns && (spread > no_chance || spread < 1 / no_chance);
  const double believed = jump ? 0 : std::max(as_said, returns_);
  const double shown = spread * factor_ * factor_;
  const double variance = (believed * learnt_ * learnt_ + returns * shown) / (believed + returns);
  become(std::sqrt(variance), std::min(max_remembered, believed + returns));
  return jump && factor_ != before;
}

}  // namespace berth::estimator
