// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/statistics.h"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/statistics/bivariate_statistics.hpp>
#include <boost/math/statistics/univariate_statistics.hpp>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/core/nan.h"

namespace berth {
namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();

/// The highest rank (from 1) whose value is above the quantile with no more than this probability:
/// the number of values below the quantile is binomial. 0: there is none.
std::size_t rank_below(std::size_t values, double share, double probability) {
  using namespace boost::math::policies;
  using Down = policy<discrete_quantile<integer_round_down>>;
  if (values == 0) return 0;
  const boost::math::binomial_distribution<double, Down> below(static_cast<double>(values), share);
  if (cdf(below, 0) > probability) return 0;
  return static_cast<std::size_t>(quantile(below, probability)) + 1;
}

}  // namespace

std::vector<double> finite(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  return values;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double variance(const std::vector<double>& values) {
  return boost::math::statistics::sample_variance(values);
}

double covariance(const std::vector<double>& x, const std::vector<double>& y) {
  return boost::math::statistics::covariance(x, y);
}

double root_mean_square(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return nan;
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), below, values.end());
  const auto above =
      std::next(below) == values.end() ? below : std::min_element(std::next(below), values.end());
  return std::lerp(*below, *above, place - std::floor(place));
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double chi_squared_quantile(double share, double degrees_of_freedom) {
  return quantile(boost::math::chi_squared(degrees_of_freedom), share);
}

double students_t_quantile(double share, double degrees_of_freedom) {
  return quantile(boost::math::students_t(degrees_of_freedom), share);
}

Bounds wilson_interval(std::size_t successes, std::size_t trials, double confidence) {
  if (trials == 0) return {0, 1};
  const double z = quantile(boost::math::normal(), 0.5 + confidence / 2);
  const auto n = static_cast<double>(trials);
  const double p = static_cast<double>(successes) / n;
  const double scale = 1 + z * z / n;
  const double centre = (p + z * z / (2 * n)) / scale;
  const double spread = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / scale;
  // Exact at both ends, without rounding.
  return {successes == 0 ? 0 : centre - spread, successes == trials ? 1 : centre + spread};
}

Bounds quantile_interval(std::vector<double> values, double share, double confidence) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double tail = (1 - confidence) / 2;
  const std::size_t below = rank_below(n, share, tail);
  const std::size_t above = rank_below(n, 1 - share, tail);  // counted from the end
  return {below == 0 ? -unbounded : values[below - 1], above == 0 ? unbounded : values[n - above]};
}

Bounds mean_interval(const std::vector<double>& values, double confidence) {
  if (values.size() < 2) return {-unbounded, unbounded};
  const auto n = static_cast<double>(values.size());
  const double half =
      students_t_quantile(0.5 + confidence / 2, n - 1) * std::sqrt(variance(values) / n);
  return {mean(values) - half, mean(values) + half};
}

double p_of_equal_shares(const std::vector<std::size_t>& successes,
                         const std::vector<std::size_t>& trials) {
  double all = 0;
  double good = 0;
  int groups = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (trials[i] == 0) continue;
    ++groups;
    all += static_cast<double>(trials[i]);
    good += static_cast<double>(successes[i]);
  }
  const double share = good / all;
  if (groups < 2 || good == 0 || good == all) return 1;
  double sum = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (trials[i] == 0) continue;
    const auto n = static_cast<double>(trials[i]);
    const double off = static_cast<double>(successes[i]) - share * n;
    sum += off * off / (n * share * (1 - share));
  }
  return cdf(complement(boost::math::chi_squared(groups - 1), sum));
}

}  // namespace berth
