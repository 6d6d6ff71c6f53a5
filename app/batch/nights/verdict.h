// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "app/batch/nights/archive.h"
#include "app/batch/nights/changes.h"
#include "common/core/table.h"

namespace berth::nights {

/// How the runs of tonight's build under one case went.
struct CaseResult {
  std::string name;
  std::size_t runs = 0;
  std::size_t passed = 0;
  std::size_t failed = 0;  ///< a criterion or a step: FAIL, INCONCLUSIVE
  std::size_t errors = 0;  ///< ERROR, TIMEOUT, ABORTED
  double may_fail = 0;
  /// Probability of so many failures, or more, at the failure rate that the plan allows.
  double p_of_failures = 1;
  bool too_many_failed = false;
  double simulated_s = 0;
  double cpu_s = 0;
};

/// The results of a night and its verdict.
struct NightReport {
  std::filesystem::path out;  ///< directory of the nights; links are relative to it
  Night night;
  std::optional<Night> previous;  ///< the night before it
  std::vector<FinishedRun> runs;  ///< of both builds, in the order of the plan's cases
  std::vector<CaseResult> cases;
  ChangeReport changes;
  ArchiveResult archive;     ///< reported; judged only where a run cannot be estimated again
  std::size_t left_out = 0;  ///< runs that the time budget left no time for
  std::string notification;  ///< what went wrong with it; empty when nothing did

  /// 0 clean, 1 a regression or failures, 2 the rig was at fault.
  int exit_code() const;
  bool has_regression() const;
};

/// Judges a night: fills in the cases and the night's verdict.
void judge(const Plan& plan, NightReport& report);

/// P(at least `failed` of `runs` | each fails with this probability).
double binomial_tail(std::size_t failed, std::size_t runs, double probability);

/// Of a run directory the best page, relative to the nights' directory; empty once it is deleted.
std::string place_of(const NightReport& report, const FinishedRun& run);

/// Changes, as failures but those for the better.
Table changes_table(const std::vector<FlaggedChange>& changes);
Table cases_table(const NightReport& report);
/// All runs, of both builds, or those selected. Failures that the plan allows are inconclusive.
Table runs_table(const NightReport& report,
                 const std::function<bool(const FinishedRun&)>& selected = {});
Table archive_table(const ArchiveResult& archive);

/// As the terminal and the notified see it.
std::string text_of(const NightReport& report);
std::string json_of(const NightReport& report);
std::string junit_of(const NightReport& report);

/// Runs the plan's shell command with the summary on its standard input and, in its environment,
/// BERTH_NIGHT, BERTH_NIGHT_VERDICT, BERTH_NIGHT_EXIT_CODE, BERTH_NIGHT_DIRECTORY,
/// BERTH_NIGHT_INDEX, BERTH_NIGHT_VERSION and BERTH_NIGHT_BUILD (the program). Waits for its end.
/// @return what went wrong, or nothing
std::string notify(const std::string& command, const NightReport& report,
                   const std::filesystem::path& program);

}  // namespace berth::nights
