// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evaluation/measure/measurer.h"
#include "evaluation/measure/paired.h"

namespace berth::evaluation {

/// One measurement over one phase in several runs.
struct SideBySideRow {
  std::string phase;
  std::string measurement;  ///< with its statistic: "rms position_error"
  std::string unit;
  std::vector<double> values;  ///< of each run, in the shown unit; NaN where it was not measured
  /// Of each run against the first, where both measured at the same times (a log and its
  /// re-estimation, one seed in two configurations); intervals over blocks of neighbours.
  std::vector<std::optional<PairedDifference>> paired;
};

/// Compares runs side by side: every phase in which any of them had estimates, then the whole run,
/// with every measurement that any of them made: of series the rms.
std::vector<SideBySideRow> compare_side_by_side(const std::vector<const Measurer*>& runs);

std::string text_of_side_by_side(const std::vector<std::string>& names,
                                 const std::vector<SideBySideRow>& rows);
/// A JSON array.
std::string json_of_side_by_side(const std::vector<SideBySideRow>& rows);

}  // namespace berth::evaluation
