// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "app/runs/run_files.h"
#include "common/core/child_process.h"

namespace berth {

/// Starts every process of a run, watches them and stops them: the recorder first and last, the
/// simulated cell (unless the cell is real), the nodes, the procedure. Ends when the procedure
/// ends; without a procedure, on SIGTERM. A procedure is aborted by the first SIGTERM or SIGINT,
/// and everything is killed by the second. No process outlives this call.
/// @param with_console the operator's console as well, unless the run joins a cell, which has one;
///                     its end does not end the run
/// @return the exit code of the run: 0 passed ... 4 inconclusive.
int supervise(const RunFiles& files, bool with_console);

/// The same in a process of its own session, which a lost terminal does not end.
/// @return it, left to itself when that object goes.
std::unique_ptr<ChildProcess> supervise_in_background(const RunFiles& files, bool with_console);

}  // namespace berth
