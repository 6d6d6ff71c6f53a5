// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>

#include "app/batch/campaigns/campaign.h"

namespace berth::campaigns {

/// Runs trials, one after the other, in one process. What they share is made once.
class Experiment {
 public:
  virtual ~Experiment() = default;
  /// A function of the trial alone: no clock, nothing of the trials before. Never throws for what
  /// went wrong in the trial; that is its outcome.
  virtual TrialResult run(const Trial& trial) = 0;
  /// The same, and what there is to look at is left in `directory`, which is made.
  virtual TrialResult run_again(const Trial& trial, const std::filesystem::path& directory) = 0;
};

/// Of the campaign's manifest. @throws InputError.
std::unique_ptr<Experiment> make_experiment(const Campaign& campaign);

/// Where a worker may leave files while it runs a trial: on the machine that it runs on. Removed
/// when it has ended, however that was.
std::filesystem::path work_directory_of(pid_t worker);

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

/// What the processes took.
struct RunnerCost {
  std::int64_t trials = 0;
  double wall_s = 0;
  double user_s = 0;  ///< of the workers, what they share included
  double system_s = 0;
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
