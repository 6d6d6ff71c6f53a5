// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace berth {

// Statistics of independent values, in any order and in any unit, on Boost.Math. NaN without values
// unless stated otherwise.

/// The values without NaN and infinities.
std::vector<double> finite(std::vector<double> values);

double mean(const std::vector<double>& values);
/// Unbiased estimate of the population's variance: divided by n - 1. @pre at least two values
double variance(const std::vector<double>& values);
/// Of pairs x[i], y[i], divided by their number; covariance(x, y) / covariance(x, x) is the slope
/// of the least-squares line. @pre not empty
double covariance(const std::vector<double>& x, const std::vector<double>& y);
double root_mean_square(const std::vector<double>& values);

/// Interpolated between the order statistics at share * (n - 1).
/// @param share 0 to 1
double quantile(std::vector<double> values, double share);
double median(std::vector<double> values);

/// The middle value, of an even number the greater of the two. @pre not empty
template <class Number>
Number upper_median(std::vector<Number> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double chi_squared_quantile(double share, double degrees_of_freedom);
double students_t_quantile(double share, double degrees_of_freedom);

/// Bounds of a confidence interval in closed form.
struct Bounds {
  double low = 0;
  double high = 0;

  bool contains(double value) const { return low <= value && value <= high; }
};

/// Wilson's interval (1927) of a share: its coverage is near the confidence also for a share near 0
/// or 1 and few trials (Brown, Cai and DasGupta 2001). 0 to 1 without trials.
Bounds wilson_interval(std::size_t successes, std::size_t trials, double confidence = 0.95);

/// Interval of a quantile between order statistics, whose ranks the binomial distribution gives: no
/// assumption of a distribution; the ends to which the percentile bootstrap of a quantile comes
/// with ever more resamples (Efron 1982, section 10.2). An end for which the sample is too small is
/// infinite.
/// @param values finite
/// @param share of the quantile, 0 to 1
Bounds quantile_interval(std::vector<double> values, double share, double confidence = 0.95);

/// Student's interval of a mean. All numbers when there are fewer than two.
Bounds mean_interval(const std::vector<double>& values, double confidence = 0.95);

/// p-value of the hypothesis that all groups have the same share: Pearson's chi squared of
/// successes against failures; groups without trials do not count. 1 where there is nothing to
/// compare.
double p_of_equal_shares(const std::vector<std::size_t>& successes,
                         const std::vector<std::size_t>& trials);

}  // namespace berth
