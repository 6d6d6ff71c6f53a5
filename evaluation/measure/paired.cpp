// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/paired.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "common/core/random.h"

namespace berth::evaluation {
namespace {

struct Pairs {
  std::vector<double> before;
  std::vector<double> after;
};

Pairs finite_pairs(const std::vector<double>& before, const std::vector<double>& after) {
  if (before.size() != after.size()) {
    throw std::invalid_argument("paired_difference: " + std::to_string(before.size()) +
                                " values before, " + std::to_string(after.size()) + " after");
  }
  Pairs pairs;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!std::isfinite(before[i]) || !std::isfinite(after[i])) continue;
    pairs.before.push_back(before[i]);
    pairs.after.push_back(after[i]);
  }
  return pairs;
}

/// The statistic after, less the one before, of the pairs at these places.
class DifferenceOfPlaces {
 public:
  DifferenceOfPlaces(Statistic statistic, const Pairs& pairs)
      : statistic_(statistic), pairs_(pairs) {}

  double operator()(const std::vector<std::size_t>& places) {
    drawn_.before.clear();
    drawn_.after.clear();
    for (const std::size_t place : places) {
      drawn_.before.push_back(pairs_.before[place]);
      drawn_.after.push_back(pairs_.after[place]);
    }
    return compute(statistic_, drawn_.after) - compute(statistic_, drawn_.before);
  }

 private:
  Statistic statistic_;
  const Pairs& pairs_;
  Pairs drawn_;
};

struct Share {
  double p;
  bool at_end;  ///< no way but the one that is (and its mirror image) reaches the difference
};

/// Share of the ways to let blocks trade places in which the difference is as large as it is: of
/// all ways where they are few, of random ones else, until a hundred were as large (Besag and
/// Clifford 1991).
Share randomization(Statistic statistic, const Pairs& pairs, double difference, std::size_t block,
                    const BootstrapOptions& options) {
  constexpr std::size_t enough = 100;
  const std::size_t blocks = (pairs.before.size() + block - 1) / block;
  const bool all_ways = blocks < 63 && (std::size_t{1} << blocks) <= options.swaps;
  const std::size_t ways = all_ways ? std::size_t{1} << blocks : options.swaps;
  const double as_large = std::abs(difference) * (1 - 1e-12);

  Random random(options.seed, "randomization");
  Pairs swapped = pairs;
  std::vector<bool> swap(blocks);
  std::size_t found = 0;
  for (std::size_t way = 0; way < ways; ++way) {
    for (std::size_t b = 0; b < blocks; ++b) {
      swap[b] = ((all_ways ? way >> b : random.bits() >> 32) & 1) != 0;
    }
    for (std::size_t i = 0; i < pairs.before.size(); ++i) {
      const bool trade = swap[i / block];
      swapped.before[i] = trade ? pairs.after[i] : pairs.before[i];
      swapped.after[i] = trade ? pairs.before[i] : pairs.after[i];
    }
    const double swapped_change =
        compute(statistic, swapped.after) - compute(statistic, swapped.before);
    if (std::abs(swapped_change) >= as_large) ++found;
    if (!all_ways && found == enough) {
      return {static_cast<double>(enough) / static_cast<double>(way + 1), false};
    }
  }
  if (all_ways) return {static_cast<double>(found) / static_cast<double>(ways), found <= 2};
  return {static_cast<double>(found + 1) / static_cast<double>(ways + 1), found == 0};
}

/// Two-sided, of a difference of so many standard errors.
double students_p(double ratio, double degrees_of_freedom) {
  const boost::math::students_t t(degrees_of_freedom);
  return 2 * cdf(complement(t, std::abs(ratio)));
}

}  // namespace

PairedDifference paired_difference(Statistic statistic, const std::vector<double>& before,
                                   const std::vector<double>& after,
                                   const BootstrapOptions& options) {
  const Pairs pairs = finite_pairs(before, after);
  PairedDifference result;
  result.pairs = pairs.before.size();
  result.before = compute(statistic, pairs.before);
  result.after = compute(statistic, pairs.after);
  result.difference = result.after - result.before;
  if (pairs.before == pairs.after) {  // NaN of no pairs, 0 of unchanged ones; p stays 1
    result.low = result.high = result.difference;
    return result;
  }
  result.block = options.block;
  if (options.block == 0) {
    std::vector<double> differences(result.pairs);
    std::transform(pairs.after.begin(), pairs.after.end(), pairs.before.begin(),
                   differences.begin(), std::minus<>());
    result.block = block_length(differences);
  }
  const Interval interval =
      bca_interval(result.pairs, result.block, DifferenceOfPlaces(statistic, pairs), options);
  result.low = interval.low;
  result.high = interval.high;
  const Share share = randomization(statistic, pairs, result.difference, result.block, options);
  result.p_value = share.p;
  // The same shift in every pair has no spread to measure it by.
  const bool spread = interval.sigma > 1e-9 * std::abs(result.difference);
  const bool sums = statistic == Statistic::mean || statistic == Statistic::rms;
  if (share.at_end && sums && spread && std::isfinite(interval.sigma)) {
    const double p = students_p(result.difference / interval.sigma, result.independent() - 1);
    result.p_value = std::min(result.p_value, p);
  }
  return result;
}

std::vector<double> holm(const std::vector<double>& p_values) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < p_values.size(); ++i) {
    if (!std::isnan(p_values[i])) order.push_back(i);
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<double> adjusted(p_values.size(), std::numeric_limits<double>::quiet_NaN());
  double largest = 0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const auto remaining = static_cast<double>(order.size() - rank);
    largest = std::max(largest, std::min(1.0, p_values[order[rank]] * remaining));
    adjusted[order[rank]] = largest;
  }
  return adjusted;
}

}  // namespace berth::evaluation
