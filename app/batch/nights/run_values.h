// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/nights/history.h"
#include "evaluation/compare/comparison.h"

namespace berth::nights {

/// Every measurement in every phase of a run, and the value of every criterion (its name is the
/// statistic). One code measures both builds: what differs is the estimator, not the measuring.
std::vector<RunValue> values_of(const evaluation::ComparedRun& run);

/// Fills in outcome, reason, hashes, durations and values of a run from its directory.
/// @param exit_code of its process, or 128 + signal
void read_results(const std::filesystem::path& directory, int exit_code, FinishedRun& run);

}  // namespace berth::nights
