// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/paired.h"

#include <cmath>
#include <limits>

#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::evaluation;

namespace {

struct Made {
  std::vector<double> before;
  std::vector<double> after;
};

/// Pairs that share much, as two builds on one seed do; after is worse by shift, and what is left
/// hangs together from pair to pair by the correlation.
Made made_pairs(Random& random, std::size_t size, double shift, double correlation = 0,
                bool skewed = false) {
  Made made;
  double noise = random.normal();
  for (std::size_t i = 0; i < size; ++i) {
    noise = correlation * noise + std::sqrt(1 - correlation * correlation) * random.normal();
    const double shared = random.normal(5.0);
    made.before.push_back(shared);
    made.after.push_back(shared + shift +
                         (skewed ? std::exp(0.5 * noise) - std::exp(0.125) : noise));
  }
  return made;
}

struct Rates {
  double covered = 0;
  double found = 0;
};

/// Over many made experiments: how often the interval holds the shift, how often p < 0.05.
Rates rates(int trials, std::size_t size, double shift, double correlation = 0, bool skewed = false,
            std::size_t block = 1) {
  Random random(11, "paired test");
  BootstrapOptions options;
  options.resamples = 1000;
  options.swaps = 2000;
  options.block = block;
  Rates result;
  for (int t = 0; t < trials; ++t) {
    const Made made = made_pairs(random, size, shift, correlation, skewed);
    const auto d = paired_difference(Statistic::mean, made.before, made.after, options);
    if (d.low <= shift && shift <= d.high) result.covered += 1.0 / trials;
    if (d.significant(0.05)) result.found += 1.0 / trials;
  }
  return result;
}

}  // namespace

// Standard error of a rate near 0.95 in 1,000 trials is 0.007, in 400 trials 0.011.

TEST_CASE("An interval of a paired difference has its nominal coverage") {
  const Rates few = rates(1000, 10, 0.3);
  CHECK(few.covered > 0.925);
  CHECK(few.covered < 0.98);
  const Rates many = rates(400, 100, 0.3);
  CHECK(many.covered > 0.92);
  CHECK(many.covered < 0.98);
  const Rates skewed = rates(400, 40, 0, 0, true);
  CHECK(skewed.covered > 0.91);
}

TEST_CASE("Without a difference the false positive rate is as stated; a known shift is found") {
  const Rates none = rates(1000, 20, 0);
  CHECK(none.found > 0.025);
  CHECK(none.found < 0.075);
  CHECK(rates(1000, 8, 0).found < 0.07);     // eight pairs: 256 ways to trade places
  CHECK(rates(200, 20, 1).found > 0.97);     // power of the t-test: 0.988
  CHECK(rates(200, 200, 0.3).found > 0.97);  // 0.988
}

TEST_CASE("Pairs that hang together are drawn in blocks") {
  const Rates ignored = rates(300, 300, 0, 0.8, false, 1);
  CHECK(ignored.found > 0.3);  // if they are taken for independent
  const Rates blocks = rates(300, 300, 0, 0.8, false, 0);
  CHECK(blocks.found < 0.11);
  CHECK(blocks.covered > 0.87);
}

TEST_CASE("The block grows with the correlation and is short without") {
  Random random(3, "block");
  double previous = 0;
  for (const double correlation : {0.0, 0.5, 0.9}) {
    double sum = 0;
    for (int t = 0; t < 30; ++t) {
      const Made made = made_pairs(random, 400, 0, correlation);
      std::vector<double> difference;
      for (std::size_t i = 0; i < 400; ++i) difference.push_back(made.after[i] - made.before[i]);
      sum += static_cast<double>(block_length(difference)) / 30;
    }
    if (correlation == 0) CHECK(sum < 3);
    CHECK(sum > previous);
    previous = sum;
  }
  CHECK(block_length(std::vector<double>(100, 4.0)) == 1);
  CHECK(block_length({1, 2, 3}) == 1);
}

TEST_CASE("Other statistics than the mean are compared too") {
  Random random(5, "statistics");
  Made made;
  for (int i = 0; i < 200; ++i) {
    made.before.push_back(random.normal(1.0));
    made.after.push_back(random.normal(1.5));
  }
  for (const Statistic statistic : {Statistic::rms, Statistic::p95}) {
    const auto d = paired_difference(statistic, made.before, made.after);
    INFO(name_of(statistic));
    CHECK(d.before == compute(statistic, made.before));
    CHECK(d.after == compute(statistic, made.after));
    CHECK(d.low < d.difference);
    CHECK(d.difference < d.high);
    CHECK(d.low > 0);
    CHECK(d.p_value < 0.001);
  }
  CHECK(paired_difference(Statistic::mean, made.before, made.after).p_value > 0.05);
}

TEST_CASE("What did not change is no difference, few pairs prove nothing") {
  const auto same = paired_difference(Statistic::rms, {1, 2, 3, 4}, {1, 2, 3, 4});
  CHECK(same.difference == 0);
  CHECK(same.low == 0);
  CHECK(same.high == 0);
  CHECK(same.p_value == 1);

  const auto two = paired_difference(Statistic::mean, {1, 2}, {5, 6});
  CHECK(two.difference == 4);
  CHECK(std::isinf(two.low));
  CHECK(two.p_value == 0.5);  // of four ways to trade places, two are as large
  CHECK(paired_difference(Statistic::mean, {1, 2, 3, 4, 5, 6}, {2, 3, 4, 5, 6, 7}).p_value ==
        2.0 / 64);

  const auto none = paired_difference(Statistic::mean, {}, {});
  CHECK(none.pairs == 0);
  CHECK(std::isnan(none.difference));
  CHECK(none.p_value == 1);
}

TEST_CASE("A significant difference is distinguished from one that few pairs cannot prove") {
  // Ten pairs can trade places in 1,024 ways; a hundred measurements require more.
  Random random(17, "few");
  const auto p_of = [&random](double shift) {
    const Made made = made_pairs(random, 10, shift);
    return paired_difference(Statistic::mean, made.before, made.after).p_value;
  };
  CHECK(p_of(8) < 1e-6);
  CHECK(p_of(2) < 0.01);
  CHECK(p_of(2) > 1e-7);
}

TEST_CASE("Pairs that could not be measured are left out") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto d = paired_difference(Statistic::mean, {1, nan, 3, 4}, {1, 2, nan, 4.5});
  CHECK(d.pairs == 2);
  CHECK(d.after == 2.75);
  CHECK_THROWS_AS(paired_difference(Statistic::mean, {1}, {1, 2}), std::invalid_argument);
}

TEST_CASE("The same options give the same numbers") {
  Random random(9, "again");
  const Made made = made_pairs(random, 50, 0.2);
  BootstrapOptions options;
  const auto first = paired_difference(Statistic::mean, made.before, made.after, options);
  const auto second = paired_difference(Statistic::mean, made.before, made.after, options);
  CHECK(first.low == second.low);
  CHECK(first.p_value == second.p_value);
  options.seed = 2;
  CHECK(paired_difference(Statistic::mean, made.before, made.after, options).low != first.low);
}

TEST_CASE("Holm's adjustment keeps the family-wise alpha") {
  const auto adjusted = holm({0.01, 0.04, 0.03, 0.005});
  CHECK(adjusted[3] == Approx(0.02));
  CHECK(adjusted[0] == Approx(0.03));
  CHECK(adjusted[2] == Approx(0.06));
  CHECK(adjusted[1] == Approx(0.06));
  CHECK(std::isnan(holm({std::numeric_limits<double>::quiet_NaN(), 0.02})[0]));
  CHECK(holm({std::numeric_limits<double>::quiet_NaN(), 0.02})[1] == Approx(0.02));

  Random random(13, "families");
  int flagged = 0;
  for (int family = 0; family < 1000; ++family) {
    std::vector<double> p(20);
    for (double& value : p) value = random.uniform();
    const auto of_family = holm(p);
    if (*std::min_element(of_family.begin(), of_family.end()) < 0.05) ++flagged;
  }
  CHECK(flagged > 25);
  CHECK(flagged < 75);
}
