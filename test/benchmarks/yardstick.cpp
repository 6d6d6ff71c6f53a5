// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/yardstick.h"

#include "test/benchmarks/statistics.h"

namespace berth::benchmark {

bool Yardstick::share_at_least(int successes, int trials, double least) const {
  return strict_ ? successes >= least * trials : wilson(successes, trials).high >= least;
}

bool Yardstick::share_at_most(int successes, int trials, double most) const {
  return strict_ ? successes <= most * trials : wilson(successes, trials).low <= most;
}

bool Yardstick::at_most(const std::vector<double>& values,
                        const std::function<double(const std::vector<double>&)>& statistic,
                        double most) const {
  return (strict_ ? statistic(values) : bootstrap(values, statistic).low) <= most;
}

bool Yardstick::milliseconds_at_most(double milliseconds, double most) const {
  return !strict_ || milliseconds <= most;
}

}  // namespace berth::benchmark
