// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/criterion_result_t.hpp>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "logs/measure/measurement.h"

namespace berth::logs {

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
std::vector<Criterion> read_criteria(Config& procedure);

/// Value, limits and uncertainty in the measurement's shown unit. Truth decides only as far as it
/// goes: a value within two of its standard uncertainties of a limit is INCONCLUSIVE (as ISO
/// 14253-1), and so is one that could not be measured.
criterion_result_t judge(const Criterion& criterion, const Measurer& measurer);
std::vector<criterion_result_t> judge(const std::vector<Criterion>& criteria,
                                      const Measurer& measurer);

/// procedure_state_t::FAIL if any failed, else INCONCLUSIVE if any is, else PASS.
std::int8_t outcome_of(const std::vector<criterion_result_t>& results);

/// Distance to the nearer limit, in the shown unit; negative outside, +inf without a limit.
double margin(const criterion_result_t& result);
/// "PASS", "FAIL", "INCONCLUSIVE" or "PENDING".
const char* text_of_result(std::int8_t result);
/// "PASS", "FAIL", "ERROR", "ABORTED", "INCONCLUSIVE", "TIMEOUT" or "NONE".
const char* text_of_outcome(std::int8_t outcome);
/// What a program that ran or judged a procedure returns: 0 pass, 1 fail, 2 error or time-out,
/// 3 aborted, 4 inconclusive.
int exit_code_of_outcome(std::int8_t outcome);

}  // namespace berth::logs
