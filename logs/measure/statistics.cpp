// SPDX-License-Identifier: BSD-3-Clause
#include "logs/measure/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace berth::logs {
namespace {

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double rms_about(const std::vector<double>& values, double centre) {
  double sum = 0;
  for (const double v : values) sum += (v - centre) * (v - centre);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double percentile(const std::vector<double>& values, double fraction) {
  std::vector<double> magnitudes;
  magnitudes.reserve(values.size());
  for (const double v : values) magnitudes.push_back(std::abs(v));
  const double place = fraction * static_cast<double>(magnitudes.size() - 1);
  const auto below = magnitudes.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(magnitudes.begin(), below, magnitudes.end());
  const auto next = std::min_element(below + 1, magnitudes.end());
  const double above = next == magnitudes.end() ? *below : *next;
  return std::lerp(*below, above, place - std::floor(place));
}

}  // namespace

const std::vector<std::string>& statistic_names() {
  static const std::vector<std::string> names = {"rms", "mean", "peak",      "min",   "max",  "p50",
                                                 "p95", "p99",  "deviation", "first", "final"};
  return names;
}

std::optional<Statistic> statistic_named(const std::string& name) {
  const auto& names = statistic_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Statistic>(found - names.begin());
}

const std::string& name_of(Statistic statistic) {
  return statistic_names()[static_cast<std::size_t>(statistic)];
}

double compute(Statistic statistic, const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  switch (statistic) {
    case Statistic::rms:
      return rms_about(values, 0);
    case Statistic::mean:
      return mean_of(values);
    case Statistic::peak:
      return percentile(values, 1);
    case Statistic::min:
      return *std::min_element(values.begin(), values.end());
    case Statistic::max:
      return *std::max_element(values.begin(), values.end());
    case Statistic::p50:
      return percentile(values, 0.5);
    case Statistic::p95:
      return percentile(values, 0.95);
    case Statistic::p99:
      return percentile(values, 0.99);
    case Statistic::deviation:
      return rms_about(values, mean_of(values));
    case Statistic::first:
      return values.front();
    case Statistic::final:
      return values.back();
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace berth::logs
