// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/run_files.h"

namespace berth {

/// Judges a finished run from its log, read once, and writes verdict.txt, results.json,
/// results.xml, events.jsonl, report.html and at last SHA256SUMS into its directory. What cannot be
/// read, judged, drawn or written is reported on standard error and keeps nothing else from being
/// written.
/// @param code how its host ended: where the log holds no verdict, the run is not better than that
/// @param failure why the host ended early, the reason of such a verdict; empty: it did not
/// @return the exit code of the run
int write_verdict(const RunFiles& files, int code, const std::string& failure = "");

}  // namespace berth
