// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/slurm_tasks.h"

#include <algorithm>
#include <cmath>

namespace berth::campaigns {
namespace {

/// For the shell, whatever is in it.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      out += c;
    }
  }
  return out + "'";
}

/// What a shell of another machine needs to know, and nothing that asks the network.
std::string beginning(const SlurmOptions& options) {
  std::string text = "#!/bin/sh\n";
  if (!options.before.empty()) text += options.before + "\n";
  return text;
}

std::string job_name(const Campaign& campaign) {
  std::string name = "berth-" + campaign.manifest().name;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c <= ' ' || c > '~'; }, '-');
  return name;
}

std::string minutes(double seconds) {
  return std::to_string(static_cast<long>(std::ceil(seconds / 60)));
}

std::vector<std::string> beginning_of_command(const Campaign& campaign,
                                              const SlurmOptions& options) {
  std::vector<std::string> command = {"sbatch", "--parsable", "--job-name=" + job_name(campaign),
                                      "--chdir=" + campaign.directory().string()};
  if (!options.partition.empty()) command.push_back("--partition=" + options.partition);
  if (!options.memory.empty()) command.push_back("--mem=" + options.memory);
  if (options.time_limit_s > 0) command.push_back("--time=" + minutes(options.time_limit_s));
  return command;
}

}  // namespace

std::int64_t trials_of_a_task(const SlurmOptions& options, double trial_s, std::int64_t missing,
                              std::int64_t max_tasks) {
  const std::int64_t least = (missing + max_tasks - 1) / std::max<std::int64_t>(1, max_tasks);
  if (options.task_trials > 0) return std::max(options.task_trials, least);
  const double wanted = std::ceil(options.task_s * options.cpus / std::max(trial_s, 1e-6));
  const auto most = static_cast<double>(std::max<std::int64_t>(1, missing));
  return std::max(static_cast<std::int64_t>(std::min(wanted, most)), least);
}

std::vector<SlurmTask> tasks_of(const std::vector<Block>& all, const std::vector<Block>& missing,
                                std::int64_t task_trials) {
  std::vector<SlurmTask> tasks;
  std::int64_t number = 0;
  for (const Block& block : missing) {
    while (all[static_cast<std::size_t>(number)].begin != block.begin) ++number;
    if (tasks.empty() || tasks.back().trials >= task_trials) tasks.push_back({number, 0, 0});
    tasks.back().count = number + 1 - tasks.back().first;
    tasks.back().trials += block.size();
  }
  return tasks;
}

std::filesystem::path SlurmFolder::log(std::size_t task) const {
  return path / ("task-" + std::to_string(task) + ".log");
}

std::filesystem::path SlurmFolder::exit_file(std::size_t task) const {
  return path / ("task-" + std::to_string(task) + ".exit");
}

std::string text_of(const std::vector<SlurmTask>& tasks) {
  std::string text;
  for (const SlurmTask& task : tasks) {
    text += std::to_string(task.first) + " " + std::to_string(task.count) + "\n";
  }
  return text;
}

std::string task_script(const Campaign& campaign, const SlurmFolder& folder,
                        const SlurmOptions& options, const std::filesystem::path& program) {
  return beginning(options) + "line=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" " +
         quoted(folder.tasks().string()) + ")\n" + "hostname\n" + quoted(program.string()) +
         " campaign block " + quoted(campaign.directory().string()) +
         " \"${line% *}\" --count \"${line#* }\" --jobs " + std::to_string(options.cpus) +
         "\ncode=$?\n" + "echo $code >" + quoted(folder.path.string()) +
         "/task-$SLURM_ARRAY_TASK_ID.exit\nexit $code\n";
}

std::string merge_script(const Campaign& campaign, const SlurmOptions& options,
                         const std::filesystem::path& program) {
  return beginning(options) + "exec " + quoted(program.string()) + " campaign merge " +
         quoted(campaign.directory().string()) + "\n";
}

std::vector<std::string> array_command(const Campaign& campaign, const SlurmFolder& folder,
                                       const SlurmOptions& options, std::size_t tasks) {
  auto command = beginning_of_command(campaign, options);
  std::string array = "--array=0-" + std::to_string(tasks - 1);
  if (options.at_a_time > 0) array += "%" + std::to_string(options.at_a_time);
  command.push_back(array);
  command.push_back("--ntasks=1");
  command.push_back("--cpus-per-task=" + std::to_string(options.cpus));
  command.push_back("--output=" + (folder.path / "task-%a.log").string());
  command.insert(command.end(), options.arguments.begin(), options.arguments.end());
  command.push_back(folder.script().string());
  return command;
}

std::vector<std::string> merge_command(const Campaign& campaign, const SlurmFolder& folder,
                                       const SlurmOptions& options, const std::string& array_job) {
  auto command = beginning_of_command(campaign, options);
  // Whatever came of the tasks: what is there is merged, and what is missing is said.
  command.push_back("--dependency=afterany:" + array_job);
  command.push_back("--output=" + (folder.path / "merge.log").string());
  command.insert(command.end(), options.arguments.begin(), options.arguments.end());
  command.push_back(folder.merge_script().string());
  return command;
}

}  // namespace berth::campaigns
