// SPDX-License-Identifier: BSD-3-Clause
// Intervals against published and computed values, and against what they promise.
#include "common/core/statistics.h"

#include <cmath>

#include "common/core/random.h"
#include "test/catch.h"

namespace berth {
namespace {

TEST_CASE("the middle and the spread of a few values") {
  CHECK(median({4, 1, 3, 2}) == 2.5);
  CHECK(upper_median(std::vector<int>{4, 1, 3, 2}) == 3);
  CHECK(upper_median(std::vector<double>{3, 1, 2}) == 2);
  CHECK(quantile({3, 1, 2}, 0) == 1);
  CHECK(quantile({3, 1, 2}, 1) == 3);
  CHECK(quantile({30, 10, 20}, 0.25) == 15);
  CHECK(finite({1, std::nan(""), 2, std::log(0)}) == std::vector<double>{1, 2});
  CHECK(mean({1, 2, 6}) == 3);
  CHECK(std::isnan(mean({})));
  CHECK(variance({1, 2, 6}) == Approx(7));
  CHECK(covariance({1, 2, 3}, {2, 4, 6}) / covariance({1, 2, 3}, {1, 2, 3}) == Approx(2));
  CHECK(root_mean_square({3, -4, 0, 0}) == 2.5);
}

TEST_CASE("quantiles of distributions have the values of the tables") {
  CHECK(chi_squared_quantile(0.975, 6) == Approx(14.4494).margin(5e-5));
  CHECK(students_t_quantile(0.975, 10) == Approx(2.2281).margin(5e-5));
}

TEST_CASE("Wilson's interval has the published values") {
  // Newcombe (1998), table I, method 3.
  const auto near = [](Bounds b, double low, double high) {
    CHECK(b.low == Approx(low).margin(5e-5));
    CHECK(b.high == Approx(high).margin(5e-5));
  };
  near(wilson_interval(81, 263), 0.2553, 0.3662);
  near(wilson_interval(15, 148), 0.0624, 0.1605);
  near(wilson_interval(0, 20), 0.0000, 0.1611);
  near(wilson_interval(1, 29), 0.0061, 0.1718);
  near(wilson_interval(20, 20), 0.8389, 1.0);
  CHECK(wilson_interval(0, 0).high == 1);
}

TEST_CASE("a quantile's interval is made of the ranks of the binomial distribution") {
  std::vector<double> ranks;
  for (int i = 1; i <= 100; ++i) ranks.push_back(i);
  // Known: the 95 % interval of a median of 100 is from the 40th to the 61st value.
  CHECK(quantile_interval(ranks, 0.5).low == 40);
  CHECK(quantile_interval(ranks, 0.5).high == 61);
  CHECK(quantile(ranks, 0.5) == Approx(50.5));
  CHECK(std::isinf(quantile_interval({1, 2, 3}, 0.95).high));
  CHECK(std::isnan(quantile({}, 0.5)));
}

TEST_CASE("intervals have their nominal coverage") {
  Random random(11, "coverage");
  int median = 0, p95 = 0, mean = 0, share = 0;
  constexpr int repeats = 2000;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    std::vector<double> values(150);
    std::size_t successes = 0;
    for (double& v : values) {
      v = -std::log(1 - random.uniform());  // exponential of mean 1
      successes += random.uniform() < 0.9 ? 1 : 0;
    }
    mean += mean_interval(values).contains(1);
    share += wilson_interval(successes, values.size()).contains(0.9);
    median += quantile_interval(values, 0.5).contains(std::log(2));
    p95 += quantile_interval(values, 0.95).contains(-std::log(0.05));
  }
  for (const int covered : {median, p95, mean, share}) {
    CHECK(covered > 0.925 * repeats);
    CHECK(covered < 0.985 * repeats);
  }
}

TEST_CASE("shares that differ by chance and shares that differ in truth") {
  CHECK(p_of_equal_shares({10, 10}, {20, 20}) == Approx(1));
  // 2 x 2: chi squared 400 / 99 = 4.0404 with one degree of freedom.
  CHECK(p_of_equal_shares({90, 80}, {100, 100}) == Approx(0.0477).margin(5e-4));
  CHECK(p_of_equal_shares({50, 0, 100}, {100, 0, 100}) < 1e-9);
  CHECK(p_of_equal_shares({5, 0}, {5, 0}) == 1);
}

}  // namespace
}  // namespace berth
