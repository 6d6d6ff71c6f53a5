// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "evaluation/measure/measurer.h"
#include "evaluation/measure/paired.h"

namespace berth {

/// too_few: pairs that hang together so much that they prove nothing. Perhaps better or worse: that
/// row alone would say so, but in so many rows one that does is no surprise.
enum class Judgement { same, no_difference, perhaps_better, perhaps_worse, better, worse, too_few };
const char* text_of(Judgement judgement);

/// One statistic of one measurement in one phase, before and after.
struct ChangeRow {
  std::string phase;
  std::string measurement;
  std::string statistic;
  std::string unit;  ///< of the numbers in difference
  evaluation::PairedDifference difference;
  double adjusted_p = 1;  ///< for all the rows of the table together (Holm); NaN: not tested
  Judgement judgement = Judgement::no_difference;
};

/// How many estimates went from one status to another; "none" where only one of the two spoke.
using StatusChanges = std::map<std::pair<std::string, std::string>, std::int64_t>;

/// What estimating again changed, in one run or over several.
struct Change {
  std::size_t runs = 0;
  std::vector<ChangeRow> rows;
  StatusChanges statuses;

  bool any(Judgement judgement) const;
  /// "better", "worse", "mixed" or "no difference".
  std::string verdict() const;
};

/// An old record and the one that came of it. They must outlive what is made of them.
struct RecordPair {
  const evaluation::RunRecord* before;
  const evaluation::RunRecord* after;
};

/// Compares estimates of the same returns (scan and packets), phase by phase: errors against truth
/// where both are good, and how many are good. NEES is better when it is nearer to 6. What is no
/// chance at this level, all rows taken together, is called better or worse; estimates of one run
/// hang together, which is found from them and allowed for.
/// @param level of any false alarm in the whole table, e.g. 0.05; the intervals cover 1 - level
///   each.
Change find_change(const std::vector<RecordPair>& pairs, double level);

}  // namespace berth
