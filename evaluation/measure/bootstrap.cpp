// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/bootstrap.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/core/random.h"
#include "common/core/statistics.h"
#include "evaluation/measure/statistic.h"

namespace berth::evaluation {
namespace {

const boost::math::normal normal;

/// Replicates of the statistic, in order of size.
std::vector<double> replicates(std::size_t size, std::size_t block,
                               const StatisticOfPlaces& statistic,
                               const BootstrapOptions& options) {
  Random random(options.seed, "bootstrap");
  std::vector<std::size_t> places(size);
  std::vector<double> values(options.resamples);
  for (double& value : values) {
    for (std::size_t first = 0; first < size; first += block) {
      auto place = static_cast<std::size_t>(random.uniform() * static_cast<double>(size));
      for (std::size_t i = first; i < std::min(first + block, size); ++i) {
        places[i] = place;
        if (++place == size) place = 0;
      }
    }
    value = statistic(places);
  }
  std::sort(values.begin(), values.end());
  return values;
}

/// Efron's acceleration, from the sample with one group of neighbours after the other left out.
double acceleration(std::size_t size, std::size_t block, const StatisticOfPlaces& statistic) {
  constexpr std::size_t max_groups = 200;
  const std::size_t groups = std::min(size / block, max_groups);
  std::vector<double> values(groups);
  std::vector<std::size_t> places;
  for (std::size_t g = 0; g < groups; ++g) {
    // Those with i * groups / size == g.
    const std::size_t begin = (g * size + groups - 1) / groups;
    const std::size_t end = ((g + 1) * size + groups - 1) / groups;
    places.resize(size - (end - begin));
    std::iota(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(begin), std::size_t{0});
    std::iota(places.begin() + static_cast<std::ptrdiff_t>(begin), places.end(), end);
    values[g] = statistic(places);
  }
  const double centre = mean(values);
  double squares = 0;
  double cubes = 0;
  for (const double v : values) {
    squares += (centre - v) * (centre - v);
    cubes += (centre - v) * (centre - v) * (centre - v);
  }
  return squares > 0 ? cubes / (6 * std::pow(squares, 1.5)) : 0;
}

}  // namespace

Interval bca_interval(std::size_t size, std::size_t block, const StatisticOfPlaces& statistic,
                      const BootstrapOptions& options) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double blocks = static_cast<double>(size) / static_cast<double>(block);
  if (blocks < 3) return {-infinity, infinity, infinity};

  std::vector<std::size_t> all(size);
  std::iota(all.begin(), all.end(), std::size_t{0});
  const double value = statistic(all);
  const std::vector<double> values = replicates(size, block, statistic, options);
  if (values.front() == values.back()) return {values.front(), values.back(), 0};

  const auto below = std::lower_bound(values.begin(), values.end(), value) - values.begin();
  const auto not_above = std::upper_bound(values.begin(), values.end(), value) - values.begin();
  const auto count = static_cast<double>(values.size());
  const double share = std::clamp(static_cast<double>(below + not_above) / (2 * count), 0.5 / count,
                                  1 - 0.5 / count);
  const double bias = quantile(normal, share);
  const double bend = acceleration(size, block, statistic);
  const double t = students_t_quantile(0.5 + options.confidence / 2, blocks - 1) *
                   std::sqrt(blocks / (blocks - 1));
  const auto end = [&](double z) {
    const double moved = bias + (bias + z) / std::max(1 - bend * (bias + z), 0.1);
    return quantile(values, cdf(normal, moved));
  };
  const double sigma = compute(Statistic::deviation, values) * std::sqrt(blocks / (blocks - 1));
  return {end(-t), end(t), sigma};
}

std::size_t block_length(const std::vector<double>& series) {
  const std::size_t n = series.size();
  const std::size_t max_length = std::max<std::size_t>(n / 4, 1);
  if (n < 12) return 1;
  const auto size = static_cast<double>(n);
  const double centre = mean(series);
  const auto covariance = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = lag; i < n; ++i) sum += (series[i] - centre) * (series[i - lag] - centre);
    return sum / size;
  };
  const double variance = covariance(0);
  if (!(variance > 0)) return 1;

  // The lag after which a run of autocorrelations is no more than noise.
  const double noise = 2 * std::sqrt(std::log10(size) / size);
  const auto run = std::max<std::size_t>(5, static_cast<std::size_t>(std::sqrt(std::log10(size))));
  const std::size_t farthest =
      std::min(max_length, static_cast<std::size_t>(std::ceil(std::sqrt(size))) + run);
  std::vector<double> covariances = {variance};
  std::size_t last = 0;  // the last significant lag
  for (std::size_t lag = 1; lag <= farthest && lag - last <= run; ++lag) {
    covariances.push_back(covariance(lag));
    if (std::abs(covariances.back()) > noise * variance) last = lag;
  }
  if (last == 0) return 1;

  const std::size_t window = std::min(2 * last, max_length);
  double slope = 0;
  double spectrum = variance;
  for (std::size_t lag = 1; lag <= window; ++lag) {
    if (lag >= covariances.size()) covariances.push_back(covariance(lag));
    const double at = static_cast<double>(lag) / static_cast<double>(window);
    const double weight = at <= 0.5 ? 1 : 2 * (1 - at);
    slope += 2 * weight * static_cast<double>(lag) * covariances[lag];
    spectrum += 2 * weight * covariances[lag];
  }
  const double ratio = 2 * slope * slope / (4.0 / 3.0 * spectrum * spectrum);
  const double length = std::ceil(std::cbrt(ratio * size));
  return std::isfinite(length)
             ? std::clamp<std::size_t>(static_cast<std::size_t>(length), 1, max_length)
             : max_length;
}

}  // namespace berth::evaluation
