// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/active_runs.h"
#include "common/core/child_process.h"

namespace berth {

/// Shows a running procedure in this terminal until its supervisor ends or the operator leaves, and
/// takes keys where there is a terminal to take them from. The first Ctrl-C aborts the procedure,
/// the second stops everything at once; a lost terminal only ends the showing.
/// @param observing nothing is sent, and Ctrl-C only leaves
/// @param own the supervisor where this process started it
/// @return the exit code of the run, its supervisor's or from its results; 0 when the operator
/// left.
int monitor(const ActiveRun& run, bool observing = false, ChildProcess* own = nullptr);

}  // namespace berth
