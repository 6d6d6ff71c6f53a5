// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/campaign.h"
#include "app/batch/campaigns/slurm_options.h"

namespace berth::campaigns {

/// What one task of a job array does: blocks [first, first + count) of the campaign, those among
/// them that have a result already left out.
struct SlurmTask {
  std::int64_t first = 0;
  std::int64_t count = 0;
  std::int64_t trials = 0;  ///< that are missing in it
};

/// Trials of a task, so that it takes as long as the options ask for; a scheduler takes seconds to
/// start a task, whatever it does. No more tasks than `max_tasks`.
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

}  // namespace berth::campaigns
