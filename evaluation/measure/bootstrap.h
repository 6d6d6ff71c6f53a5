// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace berth::evaluation {

/// How a sample is drawn again and again. The same options give the same numbers everywhere.
struct BootstrapOptions {
  double confidence = 0.95;
  std::size_t resamples = 4000;  ///< of the interval
  std::size_t swaps = 20000;     ///< of the test: no p-value is less than 1 / (swaps + 1)
  /// Length of the blocks of neighbours drawn together: 1 for independent samples (seeds of a
  /// night), 0 to find it from the series (estimates of one run, which are correlated).
  std::size_t block = 1;
  std::uint64_t seed = 1;
};

struct Interval {
  double low;
  double high;
  double sigma;  ///< standard error: deviation of the replicates, widened for small samples
};

/// A statistic of the sample whose members are at these places of the original one.
using StatisticOfPlaces = std::function<double(const std::vector<std::size_t>& places)>;

/// Bias-corrected and accelerated bootstrap interval (Efron 1987) of a statistic, with blocks of
/// neighbours drawn from the circle (Politis and Romano 1992), and with its level widened as
/// Student's t is wider than the normal, without which small samples are covered too seldom
/// (Hesterberg, "What teachers should know about the bootstrap", 2015).
/// @param size of the sample
/// @param block length of the blocks, at least 1
/// @return all numbers, with an infinite sigma, when there are fewer than three blocks
Interval bca_interval(std::size_t size, std::size_t block, const StatisticOfPlaces& statistic,
                      const BootstrapOptions& options);

/// Length of the blocks in which a series of this autocorrelation is best drawn: Politis and White
/// (2004) with the correction of Patton, Politis and White (2009), for the circular bootstrap. 1
/// where neighbours are independent, at most a quarter of the series.
std::size_t block_length(const std::vector<double>& series);

}  // namespace berth::evaluation
