// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "app/batch/nights/plan.h"
#include "evaluation/compare/change.h"
#include "evaluation/compare/family_test.h"

namespace berth::nights {

/// Tonight's runs and what they are compared with.
struct Evidence {
  std::vector<FinishedRun> tonight;
  /// Fixed seeds of the baseline build, run tonight. Empty without one.
  std::vector<FinishedRun> baseline;
  /// Fixed seeds of the last good night. Empty on the first.
  std::vector<FinishedRun> last_night;
  /// Fresh seeds of good nights.
  std::vector<FinishedRun> history;
  /// Of each case's procedure, by the case's name.
  std::map<std::string, std::vector<evaluation::Criterion>> criteria;
};

/// Result of the statistics.
struct ChangeReport {
  std::vector<FlaggedChange> changes;  ///< worse first
  std::size_t comparisons = 0;         ///< with enough runs on both sides
  std::vector<std::string> remarks;    ///< what could not be compared, and why
};

/// Compares in up to three ways, which share the family-wise alpha: fixed seeds with the same
/// seeds of the baseline build, and of the last good night (pairs), fresh seeds with those of the
/// nights before. Values that are all above zero are compared as ratios. Only runs of which all
/// steps came to their end are measured; whether they do, and pass, is compared by itself. Runs
/// of a procedure that was edited since are not compared.
ChangeReport find_changes(const Evidence& evidence, double family_wise_alpha,
                          const evaluation::MinimumEffect& minimum,
                          const evaluation::FamilyOptions& options = {});

}  // namespace berth::nights
