// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/measure/criterion.h"
#include "evaluation/report/html.h"
#include "evaluation/report/reported_run.h"

namespace berth::report {

/// The parts of a run's report. Empty where the run has nothing of the kind.
Html verdict_head(const RunView& view);
/// The claims of the procedure's source, met or not, and its figures drawn of this run.
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

/// How far a value is inside its limits, as a part of the limit (of half the room between two);
/// negative outside, NaN where nothing was measured or nothing limits it.
double relative_margin(const criterion_result_t& criterion);

/// "≤ 20", "3 to 5": the allowed range, without the unit.
Html limits_of(const criterion_result_t& criterion);

/// Class of page.css that colours it: "good", "bad", "unsure" or "grey".
const char* class_of_outcome(std::int8_t outcome);
const char* class_of_result(std::int8_t result);

// The parts of a report in which several runs are compared side by side. Differences are against
// the first.

/// Setup and outcome of each run. Links to the runs' own reports are relative to the page.
Html compared_head(const Views& views, const std::filesystem::path& page);
Html compared_criteria(const Views& views);
/// Errors over time, each phase from its own start.
Html compared_curves(const Views& views);
/// The estimates as x y z w p r, from each run's start.
Html compared_poses(const Views& views);
Html compared_measurements(const Views& views);

}  // namespace berth::report
