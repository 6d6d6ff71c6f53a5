// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/core/random.h"

namespace berth::benchmark {

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  const double part = at - static_cast<double>(below);
  return part == 0 ? values[below] : (1 - part) * values[below] + part * values[above];
}

double median(const std::vector<double>& values) { return percentile(values, 0.5); }

double root_mean_square(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

Interval wilson(int successes, int trials) {
  if (trials <= 0) return {0, 1};
  const double z = normal_quantile(0.975);
  const double n = trials;
  const double p = successes / n;
  const double centre = p + z * z / (2 * n);
  const double spread = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  const double scale = 1 + z * z / n;
  return {std::max(0.0, (centre - spread) / scale), std::min(1.0, (centre + spread) / scale)};
}

Interval bootstrap(const std::vector<double>& values,
                   const std::function<double(const std::vector<double>&)>& statistic) {
  if (values.empty()) return {statistic(values), statistic(values)};
  constexpr int resamples = 200;
  Random random(1, "bootstrap");
  std::vector<double> results;
  std::vector<double> sample(values.size());
  for (int i = 0; i < resamples; ++i) {
    for (double& v : sample) {
      v = values[static_cast<std::size_t>(random.uniform() * static_cast<double>(values.size()))];
    }
    results.push_back(statistic(sample));
  }
  return {percentile(results, 0.025), percentile(results, 0.975)};
}

double normal_quantile(double probability) {
  double low = -10;
  double high = 10;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    const double below = 0.5 * std::erfc(-middle / std::numbers::sqrt2);
    (below < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double chi_square_quantile(double probability, double degrees_of_freedom) {
  const double spread = 2 / (9 * degrees_of_freedom);
  return degrees_of_freedom *
         std::pow(1 - spread + normal_quantile(probability) * std::sqrt(spread), 3);
}

Interval mean_chi_square_band(int trials, int dimensions, int cells) {
  const double outside = 1 - std::pow(0.95, 1.0 / std::max(1, cells));
  const double freedom = static_cast<double>(trials) * dimensions;
  return {chi_square_quantile(0.5 * outside, freedom) / trials,
          chi_square_quantile(1 - 0.5 * outside, freedom) / trials};
}

double growth_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double sx = 0;
  double sy = 0;
  double sxx = 0;
  double sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double lx = std::log(x[i]);
    const double ly = std::log(y[i]);
    sx += lx;
    sy += ly;
    sxx += lx * lx;
    sxy += lx * ly;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

Reliability::Reliability() {
  const std::vector<double> edges = {0,   0.01, 0.05, 0.1,  0.2,  0.3, 0.5,
                                     0.7, 0.8,  0.9,  0.95, 0.99, 1};
  for (std::size_t i = 1; i < edges.size(); ++i) bins_.push_back({edges[i - 1], edges[i]});
}

void Reliability::add(double stated, bool came_true) {
  auto bin = bins_.begin();
  while (stated >= bin->high && bin + 1 != bins_.end()) ++bin;
  ++bin->count;
  bin->came_true += came_true ? 1 : 0;
  bin->sum += stated;
}

void Reliability::add(const Reliability& other) {
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    bins_[i].count += other.bins_[i].count;
    bins_[i].came_true += other.bins_[i].came_true;
    bins_[i].sum += other.bins_[i].sum;
  }
}

double Reliability::calibration_error() const {
  double sum = 0;
  int count = 0;
  for (const Bin& bin : bins_) {
    if (bin.count == 0) continue;
    sum += bin.count * std::abs(bin.stated() - bin.observed());
    count += bin.count;
  }
  return count == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / count;
}

}  // namespace berth::benchmark
