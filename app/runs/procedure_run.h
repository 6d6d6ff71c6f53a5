// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/run_files.h"
#include "procedures/engine/procedure_node.h"

namespace berth {

/// The procedure of a run directory.
ProcedureRun procedure_run(const RunFiles& files);

}  // namespace berth
