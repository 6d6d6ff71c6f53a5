// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/run_files.h"

namespace berth {

/// Judges a finished run from its log, read once, and writes verdict.txt, results.json,
/// results.xml, events.jsonl, report.html and at last SHA256SUMS into its directory. What cannot be
/// written is told on standard error and keeps nothing else from being written. @return the exit
/// code of the run; the code given where the log holds no verdict.
int write_verdict(const RunFiles& files, int code);

}  // namespace berth
