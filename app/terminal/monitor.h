// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/active_runs.h"

namespace berth {

/// Shows a running procedure in this terminal until its supervisor ends. The first Ctrl-C aborts
/// the procedure, the second stops everything at once. A lost terminal only ends the showing.
/// @return the exit code of the run, from its results.
int monitor(const ActiveRun& run);

}  // namespace berth
