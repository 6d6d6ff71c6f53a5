// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "app/batch/nights/plan.h"

namespace berth::nights {

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
