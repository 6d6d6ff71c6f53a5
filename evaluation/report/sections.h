// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/report/html.h"
#include "evaluation/report/reported_run.h"

namespace berth::report {

/// The parts of a run's report. Empty where the run has nothing of the kind.
Html verdict_head(const RunView& view);
/// What the procedure's source claims, met or not, and its figures drawn of this run.
Html claim_section(const RunView& view);
/// "3 of 4 claims met: SOURCE"; empty where nothing is claimed.
Html claims_in_words(const evaluation::Comparison& comparison);
/// The figures of the first run's procedure, drawn of these runs.
Html figures_of(const Views& views);
Html criteria_section(const RunView& view);
/// Estimate and truth as x y z w p r (the paper's Figure 10).
Html pose_section(const RunView& view);
/// Errors per axis with three sigma of estimate and truth, and their consistency.
Html error_section(const RunView& view);
/// Residuals, returns and misses over time.
Html return_section(const RunView& view);
/// Windows and returns of chosen scans on the target.
Html scan_section(const RunView& view);
/// Update rate, latency, the estimator's work.
Html timing_section(const RunView& view);
/// Delays between LIDAR, arms and host with their intervals.
Html latency_section(const RunView& view);
Html step_section(const RunView& view);
Html event_section(const RunView& view);
Html node_section(const RunView& view);
/// Every measurement of every phase.
Html measurement_section(const RunView& view);
/// The run directory's files and what the run was made of. Links are relative to the page.
Html file_section(const RunView& view, const std::filesystem::path& page);

}  // namespace berth::report
