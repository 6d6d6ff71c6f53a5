// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/statistic.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/nan.h"
#include "common/core/statistics.h"

namespace berth::evaluation {
namespace {

/// From the mean, of these values alone.
double deviation(std::vector<double> values) {
  const double centre = mean(values);
  for (double& v : values) v -= centre;
  return root_mean_square(values);
}

/// The fraction of the magnitudes' order statistics, as a mixture of two values.
struct Mixture {
  std::size_t below;
  std::size_t above;
  double share;  ///< of the one above
};

Mixture percentile(const std::vector<double>& values, double fraction) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const double place = fraction * static_cast<double>(order.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto smaller = [&values](std::size_t a, std::size_t b) {
    return std::abs(values[a]) < std::abs(values[b]);
  };
  const auto at = order.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(order.begin(), at, order.end(), smaller);
  const auto next =
      std::next(at) == order.end() ? at : std::min_element(std::next(at), order.end(), smaller);
  return {*at, *next, place - static_cast<double>(below)};
}

/// Which values a statistic picks; nothing for those made of all values.
std::optional<Mixture> picked(Statistic statistic, const std::vector<double>& values) {
  const auto only = [&values](auto place) {
    const auto i = static_cast<std::size_t>(place - values.begin());
    return Mixture{i, i, 0};
  };
  switch (statistic) {
    case Statistic::peak:
      return percentile(values, 1);
    case Statistic::min:
      return only(std::min_element(values.begin(), values.end()));
    case Statistic::max:
      return only(std::max_element(values.begin(), values.end()));
    case Statistic::p50:
      return percentile(values, 0.5);
    case Statistic::p90:
      return percentile(values, 0.9);
    case Statistic::p95:
      return percentile(values, 0.95);
    case Statistic::p99:
      return percentile(values, 0.99);
    case Statistic::first:
      return only(values.begin());
    case Statistic::final:
      return only(std::prev(values.end()));
    default:
      return std::nullopt;
  }
}

bool of_magnitude(Statistic statistic) {
  return statistic == Statistic::peak || statistic == Statistic::p50 ||
         statistic == Statistic::p90 || statistic == Statistic::p95 || statistic == Statistic::p99;
}

}  // namespace

const std::vector<std::string>& statistic_names() {
  static const std::vector<std::string> names = {"rms", "mean",      "peak",  "min",
                                                 "max", "p50",       "p90",   "p95",
                                                 "p99", "deviation", "first", "final"};
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
  if (values.empty()) return nan;
  if (const auto pick = picked(statistic, values)) {
    const double below = values[pick->below];
    const double above = values[pick->above];
    return of_magnitude(statistic) ? std::lerp(std::abs(below), std::abs(above), pick->share)
                                   : below;
  }
  switch (statistic) {
    case Statistic::mean:
      return mean(values);
    case Statistic::deviation:
      return deviation(values);
    default:
      return root_mean_square(values);
  }
}

double uncertainty(Statistic statistic, const std::vector<double>& values,
                   const std::vector<double>& sigmas) {
  if (values.empty()) return nan;
  if (const auto pick = picked(statistic, values)) {
    return std::lerp(sigmas[pick->below], sigmas[pick->above], pick->share);
  }
  return statistic == Statistic::mean ? mean(sigmas) : root_mean_square(sigmas);
}

}  // namespace berth::evaluation
