// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/family_test.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/core/nan.h"
#include "common/core/random.h"

namespace berth::evaluation {
namespace {

/// Student's t of so many degrees of freedom as a normal deviate (Wallace 1959, formula 2): makes
/// tests with different numbers of runs comparable.
double normal_deviate(double t, double degrees) {
  if (std::isinf(t)) return std::numeric_limits<double>::infinity();
  return std::sqrt(degrees * std::log1p(t * t / degrees)) * (8 * degrees + 1) / (8 * degrees + 3);
}

/// Without spread there is still rounding.
double ratio(double change, double variance_of_change) {
  const double spread = std::sqrt(std::max(0.0, variance_of_change));
  return spread <= 1e-12 * std::abs(change) ? std::numeric_limits<double>::infinity()
                                            : std::abs(change) / spread;
}

/// p of every test: how often the greatest strength of a shuffle was at least its own.
void count_shuffles(std::vector<TestResult>& results, const std::vector<double>& strength,
                    std::vector<double> greatest) {
  std::sort(greatest.begin(), greatest.end());
  for (std::size_t q = 0; q < results.size(); ++q) {
    if (strength[q] == 0) continue;
    // A hair less, so that the same shuffle summed in another order counts.
    const auto first = std::lower_bound(greatest.begin(), greatest.end(),
                                        std::isinf(strength[q]) ? 1e300 : strength[q] * (1 - 1e-9));
    const auto as_strong = static_cast<double>(greatest.end() - first);
    results[q].p = (as_strong + 1) / (static_cast<double>(greatest.size()) + 1);
  }
}

struct Member {
  std::size_t run;
  double value;
};

/// The values that a test uses in every shuffle.
struct PairedTest {
  std::size_t test;
  std::size_t group;
  std::vector<Member> differences;
  double squares = 0;
  double min_effect = 0;

  double strength(double sum) const {
    const auto n = static_cast<double>(differences.size());
    const double mean = sum / n;
    if (std::abs(mean) < min_effect || mean == 0) return 0;
    return normal_deviate(ratio(mean, (squares / n - mean * mean) / (n - 1)), n - 1);
  }
};

struct UnpairedTest {
  std::size_t test;
  std::size_t group;
  std::vector<double> value;    // of each run of the group, less the mean of all; 0 where none
  std::vector<double> present;  // 1, or 0 where there is no value
  double count = 0;
  double sum = 0;
  double squares = 0;
  double min_effect = 0;

  double strength(double n, double of_drawn) const {
    const double rest = count - n;
    if (n < 2 || rest < 2) return 0;
    const double mean = of_drawn / n;
    const double other = (sum - of_drawn) / rest;
    if (std::abs(mean - other) < min_effect || mean == other) return 0;
    const double within = squares - n * mean * mean - rest * other * other;
    const double degrees = n + rest - 2;
    return normal_deviate(ratio(mean - other, within / degrees * (1 / n + 1 / rest)), degrees);
  }
};

std::size_t groups_of(const std::vector<Test>& tests) {
  std::size_t groups = 0;
  for (const Test& q : tests) groups = std::max(groups, q.group + 1);
  return groups;
}

}  // namespace

std::vector<TestResult> paired_family(const std::vector<Test>& tests,
                                      const FamilyOptions& options) {
  std::vector<TestResult> results(tests.size(), {nan, 1});
  std::vector<double> strength(tests.size(), 0);
  std::vector<PairedTest> family;
  std::vector<std::size_t> runs(groups_of(tests), 0);
  for (std::size_t q = 0; q < tests.size(); ++q) {
    PairedTest paired{q, tests[q].group, {}, 0, tests[q].min_effect};
    double sum = 0;
    double size = 0;
    for (std::size_t i = 0; i < tests[q].after.size(); ++i) {
      const double difference = tests[q].after[i] - tests[q].before[i];
      if (!std::isfinite(difference)) continue;
      paired.differences.push_back({i, difference});
      sum += difference;
      size += std::abs(difference);
      paired.squares += difference * difference;
    }
    const std::size_t n = paired.differences.size();
    if (n < min_values) continue;
    results[q].change = sum / static_cast<double>(n);
    runs[paired.group] = std::max(runs[paired.group], tests[q].after.size());
    strength[q] = paired.strength(sum);
    // No shuffle can make more of it than this: it never is the greatest of one.
    if (size / static_cast<double>(n) >= paired.min_effect && size > 0) family.push_back(paired);
  }

  Random random(options.seed, "paired family");
  std::vector<double> greatest(options.shuffles, 0);
  std::vector<std::vector<double>> sign(runs.size());
  for (double& max_strength : greatest) {
    for (std::size_t g = 0; g < runs.size(); ++g) {
      sign[g].resize(runs[g]);
      for (double& s : sign[g]) s = (random.bits() >> 40 & 1) != 0 ? 1 : -1;
    }
    for (const PairedTest& paired : family) {
      double sum = 0;
      for (const Member& m : paired.differences) sum += sign[paired.group][m.run] * m.value;
      max_strength = std::max(max_strength, paired.strength(sum));
    }
  }
  count_shuffles(results, strength, std::move(greatest));
  return results;
}

std::vector<TestResult> unpaired_family(const std::vector<Test>& tests,
                                        const FamilyOptions& options) {
  std::vector<TestResult> results(tests.size(), {nan, 1});
  std::vector<double> strength(tests.size(), 0);
  std::vector<UnpairedTest> family;
  struct Deal {
    std::size_t before = 0;
    std::size_t after = 0;
    std::vector<std::size_t> order;  // the first `after` of it are drawn
  };
  std::vector<Deal> deals(groups_of(tests));
  for (std::size_t q = 0; q < tests.size(); ++q) {
    const Test& test = tests[q];
    UnpairedTest unpaired{q, test.group, test.before, {}, 0, 0, 0, test.min_effect};
    auto& value = unpaired.value;
    value.insert(value.end(), test.after.begin(), test.after.end());
    double mean = 0;
    double later = 0;
    for (std::size_t i = 0; i < value.size(); ++i) {
      const bool present = std::isfinite(value[i]);
      unpaired.present.push_back(present ? 1 : 0);
      if (!present) continue;
      mean += value[i];
      unpaired.count += 1;
      if (i >= test.before.size()) later += 1;
    }
    if (unpaired.count - later < min_values || later < min_new_values) continue;
    mean /= unpaired.count;
    double of_after = 0;
    for (std::size_t i = 0; i < value.size(); ++i) {
      value[i] = unpaired.present[i] != 0 ? value[i] - mean : 0;
      unpaired.sum += value[i];
      unpaired.squares += value[i] * value[i];
      if (i >= test.before.size()) of_after += value[i];
    }
    results[q].change = of_after / later - (unpaired.sum - of_after) / (unpaired.count - later);
    strength[q] = unpaired.strength(later, of_after);
    deals[unpaired.group].before = test.before.size();
    deals[unpaired.group].after = test.after.size();
    if (unpaired.squares > 0) family.push_back(std::move(unpaired));
  }

  Random random(options.seed, "unpaired family");
  std::vector<double> greatest(options.shuffles, 0);
  for (Deal& deal : deals) {
    deal.order.resize(deal.before + deal.after);
    std::iota(deal.order.begin(), deal.order.end(), std::size_t{0});
  }
  for (double& max_strength : greatest) {
    for (Deal& deal : deals) {
      for (std::size_t i = 0; i < deal.after; ++i) {
        const std::size_t other = i + random.bits() % (deal.order.size() - i);
        std::swap(deal.order[i], deal.order[other]);
      }
    }
    for (const UnpairedTest& unpaired : family) {
      double n = 0;
      double sum = 0;
      const Deal& deal = deals[unpaired.group];
      for (std::size_t i = 0; i < deal.after; ++i) {
        n += unpaired.present[deal.order[i]];
        sum += unpaired.value[deal.order[i]];
      }
      max_strength = std::max(max_strength, unpaired.strength(n, sum));
    }
  }
  count_shuffles(results, strength, std::move(greatest));
  return results;
}

}  // namespace berth::evaluation
