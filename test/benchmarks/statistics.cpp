// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/random.h"

namespace berth::benchmark {

Bounds wilson(int successes, int trials) {
  return wilson_interval(static_cast<std::size_t>(successes), static_cast<std::size_t>(trials));
}

Bounds bootstrap(const std::vector<double>& values,
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
  return {quantile(results, 0.025), quantile(results, 0.975)};
}

Bounds mean_chi_square_band(int trials, int dimensions, int cells) {
  const double outside = 1 - std::pow(0.95, 1.0 / std::max(1, cells));
  const double freedom = static_cast<double>(trials) * dimensions;
  return {chi_squared_quantile(0.5 * outside, freedom) / trials,
          chi_squared_quantile(1 - 0.5 * outside, freedom) / trials};
}

double growth_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<double> log_x(x.size());
  std::vector<double> log_y(y.size());
  const auto log = [](double v) { return std::log(v); };
  std::transform(x.begin(), x.end(), log_x.begin(), log);
  std::transform(y.begin(), y.end(), log_y.begin(), log);
  return covariance(log_x, log_y) / covariance(log_x, log_x);
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
