// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/proportion.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace berth::evaluation {
namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();

/// The highest rank (from 1) whose value is above the quantile with no more than this chance: the
/// number of values below the quantile is binomial. 0: there is none.
std::size_t rank_below(std::size_t values, double share, double chance) {
  using namespace boost::math::policies;
  using Down = policy<discrete_quantile<integer_round_down>>;
  if (values == 0) return 0;
  const boost::math::binomial_distribution<double, Down> below(static_cast<double>(values), share);
  if (cdf(below, 0) > chance) return 0;
  return static_cast<std::size_t>(quantile(below, chance)) + 1;
}

}  // namespace

Bounds wilson_interval(std::size_t successes, std::size_t trials, double confidence) {
  if (trials == 0) return {0, 1};
  const double z = quantile(boost::math::normal(), 0.5 + confidence / 2);
  const auto n = static_cast<double>(trials);
  const double p = static_cast<double>(successes) / n;
  const double scale = 1 + z * z / n;
  const double centre = (p + z * z / (2 * n)) / scale;
  const double spread = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / scale;
  // Exact where rounding would be seen.
  return {successes == 0 ? 0 : centre - spread, successes == trials ? 1 : centre + spread};
}

Bounds quantile_interval(const std::vector<double>& sorted, double share, double confidence) {
  const std::size_t n = sorted.size();
  const double tail = (1 - confidence) / 2;
  const std::size_t below = rank_below(n, share, tail);
  const std::size_t above = rank_below(n, 1 - share, tail);  // counted from the end
  return {below == 0 ? -unbounded : sorted[below - 1], above == 0 ? unbounded : sorted[n - above]};
}

double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], place - static_cast<double>(below));
}

Bounds mean_interval(const std::vector<double>& values, double confidence) {
  if (values.size() < 2) return {-unbounded, unbounded};
  const auto n = static_cast<double>(values.size());
  double mean = 0;
  for (const double v : values) mean += v / n;
  double squares = 0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  const double t = quantile(boost::math::students_t(n - 1), 0.5 + confidence / 2);
  const double half = t * std::sqrt(squares / (n - 1) / n);
  return {mean - half, mean + half};
}

double chance_of_equal_shares(const std::vector<std::size_t>& successes,
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

}  // namespace berth::evaluation
