// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/yardstick.h"

#include "test/benchmarks/statistics.h"

namespace berth::benchmark {

bool Yardstick::share_at_least(int successes, int trials, double min) const {
  return strict_ ? successes >= min * trials : wilson(successes, trials).high >= min;
}

bool Yardstick::share_at_most(int successes, int trials, double max) const {
  return strict_ ? successes <= max * trials : wilson(successes, trials).low <= max;
}

bool Yardstick::at_most(const std::vector<double>& values,
                        const std::function<double(const std::vector<double>&)>& statistic,
                        double max) const {
  return (strict_ ? statistic(values) : bootstrap(values, statistic).low) <= max;
}

bool Yardstick::milliseconds_at_most(double milliseconds, double max) const {
  return !strict_ || milliseconds <= max;
}

}  // namespace berth::benchmark
