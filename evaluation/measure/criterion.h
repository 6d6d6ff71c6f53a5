// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/config.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/run/outcome.h"

namespace berth::evaluation {

/// A measurement with its limits, all in SI units.
struct Criterion {
  std::string name;
  const Measurement* measurement = nullptr;
  Statistic statistic = Statistic::rms;  ///< of a series
  std::string phase = whole_run;
  double nominal = 0;        ///< taken off the measured value
  double lower;              ///< -inf: none
  double upper;              ///< +inf: none
  std::int64_t samples = 1;  ///< fewer do not suffice
  std::string claim;         ///< of the procedure's source; empty: none
  int line = 0;              ///< in the procedure
};

/// Reads the section `criteria` of a procedure:
///
///     criteria:
///       - name: position while approaching
///         measurement: position_error
///         statistic: rms          # needed for a series, not allowed for a single number
///         phase: approach         # default: run
///         max: 20 mm              # and/or min
///         nominal: 0 mm           # optional: judge the difference from it
///         samples: 10             # optional: fewer are inconclusive
///         claim: below 20 mm      # optional: the words of the procedure's source that it judges
std::vector<Criterion> read_criteria(Config& procedure);

/// Value, limits and uncertainty in the measurement's shown unit. Truth decides only as far as it
/// goes: a value within two of its standard uncertainties of a limit is INCONCLUSIVE (as ISO
/// 14253-1), and so is one that could not be measured.
criterion_result_t judge(const Criterion& criterion, const Measurer& measurer);
std::vector<criterion_result_t> judge(const std::vector<Criterion>& criteria,
                                      const Measurer& measurer);

/// Whether the criterion's value (shown unit, without its nominal value) changed for the better: by
/// what its measurement prefers, and where that prefers nothing by its distance to the limits.
ChangeKind kind_of_change(const Criterion& criterion, double before, double after);

/// Distance to the nearer limit, in the shown unit; negative outside, +inf without a limit.
double margin(const criterion_result_t& result);

}  // namespace berth::evaluation
