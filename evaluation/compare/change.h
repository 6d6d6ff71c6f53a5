// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evaluation/measure/criterion.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/measure/paired.h"

namespace berth::evaluation {

/// Values of every run in addition to its measurements: whether it passed, whether all its steps
/// ran to their end, 1 or 0; and the number of good estimates.
inline constexpr char passed_measurement[] = "passed";
inline constexpr char completed_measurement[] = "completed";
inline constexpr char good_estimates_measurement[] = "good_estimates";

/// The smallest change of a measurement that matters in practice, in SI units.
struct MinimumEffect {
  double relative = 0.05;  ///< of the value before
  std::map<Dimension, double> absolute = {
      {Dimension::length, 0.1e-3}, {Dimension::angle, 0.0002},         {Dimension::time, 0.2e-3},
      {Dimension::speed, 0.2e-3},  {Dimension::angular_speed, 0.0002}, {Dimension::frequency, 0.05},
      {Dimension::number, 0.02}};

  /// The larger of both, in the measurement's shown unit. @param before size of the value before
  double of(const std::string& measurement, double before) const;
};

/// As the measurement itself declares, or the criterion of which this is the value.
/// @param criteria of the procedure
ChangeKind kind_of_change(const std::string& measurement, const std::string& statistic,
                          double before, double after, const std::vector<Criterion>& criteria = {});
/// "better", "worse" or "changed".
const char* name_of(ChangeKind kind);

/// too_few: pairs so correlated that they prove nothing. Perhaps better or worse: significant as a
/// single row, but not among so many rows.
enum class Judgement { same, no_difference, perhaps_better, perhaps_worse, better, worse, too_few };
const char* text_of(Judgement judgement);

/// One statistic of one measurement in one phase, before and after.
struct ChangeRow {
  std::string phase;
  std::string measurement;
  std::string statistic;
  std::string unit;  ///< of the numbers in difference
  PairedDifference difference;
  double adjusted_p = 1;  ///< for all the rows of the table together (Holm); NaN: not tested
  Judgement judgement = Judgement::no_difference;
};

/// Number of estimates that went from one status to another; "none" where only one of the two runs
/// has one.
using StatusChanges = std::map<std::pair<std::string, std::string>, std::int64_t>;

/// The changes by estimating again, in one run or over several.
struct Change {
  std::size_t runs = 0;
  std::vector<ChangeRow> rows;
  StatusChanges statuses;

  bool any(Judgement judgement) const;
  /// "better", "worse", "mixed" or "no difference".
  std::string verdict() const;
};

/// An old record and the one estimated again. They must outlive everything made of them.
struct RecordPair {
  const RunRecord* before;
  const RunRecord* after;
};

/// Compares estimates of the same returns (scan and packets), phase by phase: errors against truth
/// where both are good, and the share of good ones. NEES is better when it is nearer to 6. Changes
/// significant at this level, over all rows together, are called better or worse; estimates of one
/// run are correlated, which is found from them and allowed for.
/// @param level probability of any false alarm in the whole table, e.g. 0.05; the intervals cover 1
/// - level each.
Change find_change(const std::vector<RecordPair>& pairs, double level);

/// Table of rows, status changes and verdict, for a terminal.
std::string text_of(const Change& change, double level);
/// Numbers that are not finite become null.
nlohmann::ordered_json json_of(const Change& change);

}  // namespace berth::evaluation
