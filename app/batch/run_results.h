// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/result_store.h"
#include "evaluation/compare/comparison.h"

namespace berth {

/// Every measurement in every phase of a run, and the value of every criterion (its name is the
/// statistic). One code measures both builds: what differs is the estimator, not the measuring.
std::vector<RunValue> values_of(const evaluation::ComparedRun& run);

/// Fills in outcome, reason, hashes, duration and values of a run.
void take_results(const evaluation::ComparedRun& compared, FinishedRun& run);

/// The same from its directory; what cannot be read is the run's error.
/// @param exit_code of its process, or 128 + signal
void read_results(const std::filesystem::path& directory, int exit_code, FinishedRun& run);

}  // namespace berth
