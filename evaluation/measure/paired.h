// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "evaluation/measure/bootstrap.h"
#include "evaluation/measure/statistic.h"

namespace berth::evaluation {

/// One statistic of the same things measured before and after a change.
struct PairedDifference {
  std::size_t pairs = 0;
  double before = 0;      ///< the statistic before
  double after = 0;       ///< the statistic after
  double difference = 0;  ///< after - before
  double low = 0;         ///< confidence interval of the difference
  double high = 0;
  double p_value = 1;     ///< two-sided
  std::size_t block = 1;  ///< pairs that were drawn together

  /// Number of independent blocks; fewer than five prove nothing.
  double independent() const { return static_cast<double>(pairs) / static_cast<double>(block); }

  bool significant(double level) const { return p_value < level; }
};

/// Compares before[i] with after[i]. The interval is bootstrapped from the pairs (bca_interval);
/// the p-value is that of the randomization test, in which before and after trade places pair by
/// pair (block by block): exact where the change does nothing, whatever the distribution. It ends
/// at the number of ways to trade; a difference that no way reaches has the p-value of Student's t.
/// Pairs of which either is not finite are left out; without pairs all is NaN and p is 1.
/// @throws std::invalid_argument when the two are not equally long
PairedDifference paired_difference(Statistic statistic, const std::vector<double>& before,
                                   const std::vector<double>& after,
                                   const BootstrapOptions& options = {});

/// p-values of many tests, adjusted so that comparing each with a level keeps the probability of
/// any false alarm among them below that level (Holm 1979). In the order given; NaN counts as no
/// test.
std::vector<double> holm(const std::vector<double>& p_values);

}  // namespace berth::evaluation
