// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "app/batch/campaigns/experiment.h"
#include "app/batch/campaigns/results.h"

namespace berth::campaigns {

struct RunnerProgress {
  std::int64_t done = 0;      ///< trials with a result, those of earlier times among them
  std::int64_t done_now = 0;  ///< of them, since this began
  int workers = 0;
};

struct RunnerOptions {
  int jobs = 1;
  /// What a worker process runs trials with; it is made in that process.
  std::function<std::unique_ptr<Experiment>()> make;
  std::function<void(const RunnerProgress&)> report;  ///< several times a second; may be empty
  std::function<bool()> interrupted;                  ///< called as often; may be empty
};

/// Runs those of the blocks that have no result, each in a worker process, and writes their files
/// whole or not at all. A trial of which a worker dies (SIGSEGV, SIGABRT, ... or too much processor
/// time) is CRASHED, and the block goes on behind it; one that is killed from outside (SIGKILL,
/// SIGTERM) is tried once more. Results in a .started file of an earlier, interrupted time are
/// taken over. The caller's process must have a single thread: workers are forked from it.
/// @throws InputError when a worker cannot be started, or files cannot be written.
RunnerCost run_blocks(const Campaign& campaign, const std::vector<Block>& blocks,
                      const RunnerOptions& options);

}  // namespace berth::campaigns
