// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/batch/campaigns/campaign.h"

namespace berth::campaigns {

/// Options of a cluster. No part of the campaign: no result depends on them.
struct SlurmOptions {
  std::string partition;               ///< empty: the cluster's default
  double time_limit_s = 0;             ///< of one task; 0: the partition's
  std::string memory;                  ///< of one task, as sbatch takes it: "2G"
  int cpus = 1;                        ///< of one task: as many workers run in it
  int at_a_time = 0;                   ///< tasks; 0: as many as the cluster has room for
  double task_s = 120;                 ///< how long a task should take, at least
  double trial_s = 0;                  ///< processor time of a trial; 0: measured
  std::int64_t task_trials = 0;        ///< instead of the two above; 0: they decide
  std::vector<std::string> arguments;  ///< other ones of sbatch
  std::string before;                  ///< shell lines that a task runs first ("module load ...")
};

/// Reads a file such as
///
///     partition: main
///     time: 30 min
///     memory: 2G
///     arguments: [--account=lab, --nice=100]
///
/// @throws InputError "file:line: key ...".
SlurmOptions load_slurm_options(const std::filesystem::path& file);

/// What one task of a job array does: blocks [first, first + count) of the campaign, those among
/// them that have a result already left out.
struct SlurmTask {
  std::int64_t first = 0;
  std::int64_t count = 0;
  std::int64_t trials = 0;  ///< that are missing in it
};

/// Trials of a task, so that it takes as long as the options request: a scheduler takes seconds to
/// start any task. No more tasks than `max_tasks`.
/// @param trial_s processor time of one trial
std::int64_t trials_of_a_task(const SlurmOptions& options, double trial_s, std::int64_t missing,
                              std::int64_t max_tasks);

/// Cuts the missing blocks into tasks of so many trials.
std::vector<SlurmTask> tasks_of(const std::vector<Block>& all, const std::vector<Block>& missing,
                                std::int64_t task_trials);

/// Where one submission keeps its script, its list of tasks and their logs: DIR/slurm/NUMBER.
struct SlurmFolder {
  std::filesystem::path path;

  std::filesystem::path tasks() const { return path / "tasks.txt"; }
  std::filesystem::path script() const { return path / "task.sh"; }
  std::filesystem::path merge_script() const { return path / "merge.sh"; }
  std::filesystem::path jobs() const { return path / "jobs.json"; }
  std::filesystem::path log(std::size_t task) const;
  std::filesystem::path exit_file(std::size_t task) const;
};

/// "FIRST COUNT" on a line for each task.
std::string text_of(const std::vector<SlurmTask>& tasks);

/// The shell script of every task: finds its line by SLURM_ARRAY_TASK_ID, runs those blocks, and
/// leaves its exit code in a file. Uses no network.
std::string task_script(const Campaign& campaign, const SlurmFolder& folder,
                        const SlurmOptions& options, const std::filesystem::path& program);
/// The script of the job that follows: merges what is there and writes the report.
std::string merge_script(const Campaign& campaign, const SlurmOptions& options,
                         const std::filesystem::path& program);

/// sbatch and its arguments.
std::vector<std::string> array_command(const Campaign& campaign, const SlurmFolder& folder,
                                       const SlurmOptions& options, std::size_t tasks);
std::vector<std::string> merge_command(const Campaign& campaign, const SlurmFolder& folder,
                                       const SlurmOptions& options, const std::string& array_job);

/// A job array and the job that merges behind it.
struct SlurmJobs {
  SlurmFolder folder;
  std::string array;
  std::string merge;
  std::vector<SlurmTask> tasks;
};

/// Hands the missing trials to Slurm. The directory must be the same on all its machines.
/// @param trial_s processor time of one trial
/// @throws InputError when there is no sbatch, or it refuses: with its errors.
SlurmJobs submit(const Campaign& campaign, const SlurmOptions& options, double trial_s,
                 const std::filesystem::path& program);

/// The last submission that Slurm still has to do with, if any.
std::optional<SlurmJobs> active_jobs(const Campaign& campaign);

/// Progress of jobs as the scheduler reports it.
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
