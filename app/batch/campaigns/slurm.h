// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>

#include "app/batch/campaigns/slurm_tasks.h"

namespace berth::campaigns {

/// A job array and the job that merges behind it.
struct SlurmJobs {
  SlurmFolder folder;
  std::string array;
  std::string merge;
  std::vector<SlurmTask> tasks;
};

/// Hands the missing trials to Slurm. The directory must be the same on all its machines.
/// @param trial_s processor time of one trial
/// @throws InputError when there is no sbatch, or it refuses: with what it said.
SlurmJobs submit(const Campaign& campaign, const SlurmOptions& options, double trial_s,
                 const std::filesystem::path& program);

/// The last submission that Slurm still has to do with, if any.
std::optional<SlurmJobs> active_jobs(const Campaign& campaign);

/// How far jobs are, as the scheduler says.
struct SlurmState {
  std::size_t waiting = 0;
  std::size_t running = 0;
  std::size_t ended = 0;  ///< tasks of the array
  bool merging = false;   ///< the array has ended, the merge has not
  bool over = false;      ///< all have ended
  std::string reason;     ///< why tasks wait, in Slurm's words
};
/// @throws InputError when squeue fails for another reason than that the jobs are long over.
SlurmState state_of(const SlurmJobs& jobs);

/// A task that left trials undone, and why as far as it is known: "exit code 3", "TIMEOUT".
struct SlurmFailure {
  std::size_t task = 0;
  std::string reason;
  std::filesystem::path log;
};
/// After the end: tasks of which blocks are missing.
std::vector<SlurmFailure> failures_of(const Campaign& campaign, const SlurmJobs& jobs);

/// Ends them. @throws InputError when Slurm refuses.
void cancel(const SlurmJobs& jobs);

}  // namespace berth::campaigns
