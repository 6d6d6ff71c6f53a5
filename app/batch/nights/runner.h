// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "app/batch/nights/history.h"
#include "evaluation/compare/comparison.h"

namespace berth::nights {

/// Every measurement in every phase of a run, and the value of every criterion (its name is the
/// statistic). One code measures both builds: what differs is the estimator, not the measuring.
std::vector<RunValue> values_of(const evaluation::ComparedRun& run);

/// Fills in outcome, reason, hashes, durations and values of a run from its directory.
/// @param exit_code of its process, or 128 + signal
void read_results(const std::filesystem::path& directory, int exit_code, FinishedRun& run);

/// Where and how runs happen.
struct RunnerConfiguration {
  std::filesystem::path program;  ///< tonight's `berth`
  std::filesystem::path night;    ///< the night's directory: runs/ and work/ are made in it
  Baseline baseline;
  int jobs = 1;
  double run_timeout_s = 600;
  double time_budget_s = 0;           ///< 0: none
  std::function<bool()> interrupted;  ///< runs at work are given up; a later night does them
};

/// Runs procedures as child processes, several at a time, and reads what came of them, until all
/// have run, the time budget is used up or it is interrupted. A run that crashes or does not end is
/// a result, never the end of the night.
/// @return how many runs were not begun or given up
std::size_t run_all(const std::vector<PlannedRun>& runs, const RunnerConfiguration& configuration,
                    const std::function<void(FinishedRun)>& finished);

}  // namespace berth::nights
