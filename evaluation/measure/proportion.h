// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace berth::evaluation {

/// An interval of independent trials that needs no drawing of samples: of any number of trials in a
/// moment.
struct Bounds {
  double low = 0;
  double high = 0;
};

/// Wilson's interval (1927) of a share: near its confidence also where the share is near 0 or 1 and
/// trials are few (Brown, Cai and DasGupta 2001). 0 to 1 without trials.
Bounds wilson_interval(std::size_t successes, std::size_t trials, double confidence = 0.95);

/// Interval of a quantile between order statistics, whose ranks the binomial distribution gives: no
/// assumption of a distribution; the ends to which the percentile bootstrap of a quantile comes
/// with ever more resamples (Efron 1982, section 10.2). An end for which the sample is too small is
/// infinite.
/// @param sorted in order of size, finite
/// @param share of the quantile, 0 to 1
Bounds quantile_interval(const std::vector<double>& sorted, double share, double confidence = 0.95);

/// Quantile interpolated between the order statistics; NaN of nothing.
double quantile(const std::vector<double>& sorted, double share);

/// Student's interval of a mean. All numbers when there are fewer than two.
Bounds mean_interval(const std::vector<double>& values, double confidence = 0.95);

/// Chance that shares as different as these come from one and the same share: Pearson's chi squared
/// of successes against failures over groups; those without trials do not count. 1 where there is
/// nothing to compare.
double chance_of_equal_shares(const std::vector<std::size_t>& successes,
                              const std::vector<std::size_t>& trials);

}  // namespace berth::evaluation
