// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "common/core/statistics.h"

namespace berth::benchmark {

/// Wilson's interval of a share, 95 %.
Bounds wilson(int successes, int trials);
/// Percentile bootstrap of a statistic, 95 %, 200 resamples from a fixed seed.
Bounds bootstrap(const std::vector<double>& values,
                 const std::function<double(const std::vector<double>&)>& statistic);

/// Where the mean of `trials` chi-squared values of `dimensions` degrees of freedom lies with 95 %
/// in all of `cells` independent cells at once (Sidak).
Bounds mean_chi_square_band(int trials, int dimensions, int cells);

/// Order of growth: slope of log(y) over log(x), least squares.
double growth_exponent(const std::vector<double>& x, const std::vector<double>& y);

/// Stated probabilities against how often what was stated came true, in bins that are narrow near 0
/// and 1 (a reliability diagram: Murphy and Winkler, 1977).
class Reliability {
 public:
  struct Bin {
    double low = 0;  ///< of the stated probability, inclusive
    double high = 1;
    int count = 0;
    int came_true = 0;
    double sum = 0;  ///< of stated probabilities

    double stated() const { return sum / count; }
    double observed() const { return static_cast<double>(came_true) / count; }
  };

  Reliability();
  void add(double stated, bool came_true);
  void add(const Reliability& other);
  const std::vector<Bin>& bins() const { return bins_; }
  /// Mean distance of stated from observed, weighted by the bins' counts (expected calibration
  /// error). NaN when nothing was stated.
  double calibration_error() const;

 private:
  std::vector<Bin> bins_;
};

}  // namespace berth::benchmark
