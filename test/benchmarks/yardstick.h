// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

namespace berth::benchmark {

/// Holds a row's figures against their targets. Strict: the figures themselves. Else, for a check
/// of few trials on whatever machine: a target is missed where the 95 % interval of the figure
/// excludes it, and processor time is compared with another program's only, by the caller.
class Yardstick {
 public:
  explicit Yardstick(bool strict) : strict_(strict) {}

  /// Shares of 0 to 1.
  bool share_at_least(int successes, int trials, double min) const;
  bool share_at_most(int successes, int trials, double max) const;
  bool at_most(const std::vector<double>& values,
               const std::function<double(const std::vector<double>&)>& statistic,
               double max) const;
  bool milliseconds_at_most(double milliseconds, double max) const;

 private:
  bool strict_;
};

}  // namespace berth::benchmark
