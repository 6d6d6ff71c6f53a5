// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/run_files.h"

namespace berth {

/// Judges a finished run from its log and writes verdict.txt, results.json and report.html into its
/// directory. @return the exit code of the run; the code given where the log holds no verdict.
int write_verdict(const RunFiles& files, int code);

}  // namespace berth
