// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/slurm.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/child_process.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

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

/// For a shell on another machine; uses no network.
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

ProgramOutput slurm(const std::vector<std::string>& command) {
  try {
    return run_program(command);
  } catch (const InputError& e) {
    throw InputError(std::string(e.what()) +
                     "; --engine slurm needs Slurm's commands (Debian: slurm-client) and a "
                     "cluster, --engine local needs neither");
  }
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// "12" of sbatch's "12;cluster".
std::string submitted(const std::vector<std::string>& command) {
  const ProgramOutput output = slurm(command);
  if (!output.end.ok()) {
    std::string shown;
    for (const std::string& word : command) shown += (shown.empty() ? "" : " ") + word;
    std::string errors = output.errors;
    while (!errors.empty() && errors.back() == '\n') errors.pop_back();
    throw InputError("sbatch refused the jobs: " + errors + "\n  " + shown);
  }
  const std::string line = first_line(output.text);
  return line.substr(0, line.find(';'));
}

/// Slurm's largest array; 1001 is its own default.
std::int64_t max_tasks() {
  const std::string text = slurm({"scontrol", "show", "config"}).text;
  const auto at = text.find("MaxArraySize");
  if (at == std::string::npos) return 1000;
  return std::max(1L, std::strtol(text.c_str() + text.find('=', at) + 1, nullptr, 10) - 1);
}

SlurmFolder new_folder(const Campaign& campaign) {
  for (int number = 1;; ++number) {
    const fs::path path = campaign.directory() / "slurm" / std::to_string(number);
    if (fs::exists(path)) continue;
    std::error_code error;
    fs::create_directories(path, error);
    if (error) throw InputError(path.string() + ": " + error.message());
    return {path};
  }
}

std::optional<SlurmJobs> last_jobs(const Campaign& campaign) {
  std::optional<SlurmJobs> last;
  for (int number = 1;; ++number) {
    const SlurmFolder folder{campaign.directory() / "slurm" / std::to_string(number)};
    if (!fs::exists(folder.path)) return last;
    if (!fs::exists(folder.jobs())) continue;  // was refused
    const auto json = ordered_json::parse(read_file(folder.jobs()), nullptr, false);
    if (json.is_discarded()) throw InputError(folder.jobs().string() + ": is damaged");
    SlurmJobs jobs{folder, json.value("array", ""), json.value("merge", ""), {}};
    std::ifstream list(folder.tasks());
    SlurmTask task;
    while (list >> task.first >> task.count) jobs.tasks.push_back(task);
    last = std::move(jobs);
  }
}

bool is_over(const std::string& state) {
  return state != "PENDING" && state != "RUNNING" && state != "COMPLETING" &&
         state != "CONFIGURING" && state != "SUSPENDED" && state != "REQUEUED" &&
         state != "RESIZING" && state != "STAGE_OUT" && state != "SIGNALING";
}

/// "JobState=TIMEOUT" of scontrol's answer; empty where Slurm has forgotten the job.
std::string state_of_task(const SlurmJobs& jobs, std::size_t task) {
  const std::string text =
      slurm({"scontrol", "show", "job", jobs.array + "_" + std::to_string(task)}).text;
  const auto at = text.find("JobState=");
  if (at == std::string::npos) return "";
  const auto from = at + std::string("JobState=").size();
  return text.substr(from, text.find_first_of(" \n", from) - from);
}

std::string reason_of(const SlurmJobs& jobs, std::size_t task) {
  if (fs::exists(jobs.folder.exit_file(task))) {
    const std::string code = first_line(read_file(jobs.folder.exit_file(task)));
    if (code != "0") return "exit code " + code;
    return "it reports that all is done: is " + jobs.folder.path.string() +
           " the same on all machines?";
  }
  const std::string state = state_of_task(jobs, task);
  return state.empty() ? "it left no exit code: killed, or its machine failed" : state;
}

}  // namespace

SlurmOptions load_slurm_options(const std::filesystem::path& file) {
  SlurmOptions options;
  Config config = Config::load(file);
  config.optional("partition", options.partition);
  config.optional("time", Dimension::time, options.time_limit_s);
  config.optional("memory", options.memory);
  config.optional("cpus", options.cpus, at_least(1));
  config.optional("at_a_time", options.at_a_time);
  config.optional("task", Dimension::time, options.task_s, above(0));
  config.optional("trial", Dimension::time, options.trial_s);
  config.optional("task_trials", options.task_trials, at_least(0));
  config.optional("arguments", options.arguments);
  config.optional("before", options.before);
  config.finish();
  return options;
}

std::int64_t trials_of_a_task(const SlurmOptions& options, double trial_s, std::int64_t missing,
                              std::int64_t max_tasks) {
  const std::int64_t min_trials = (missing + max_tasks - 1) / std::max<std::int64_t>(1, max_tasks);
  if (options.task_trials > 0) return std::max(options.task_trials, min_trials);
  const double by_time = std::ceil(options.task_s * options.cpus / std::max(trial_s, 1e-6));
  const auto max_trials = static_cast<double>(std::max<std::int64_t>(1, missing));
  return std::max(static_cast<std::int64_t>(std::min(by_time, max_trials)), min_trials);
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
  // However the tasks end, present results are merged and missing ones reported.
  command.push_back("--dependency=afterany:" + array_job);
  command.push_back("--output=" + (folder.path / "merge.log").string());
  command.insert(command.end(), options.arguments.begin(), options.arguments.end());
  command.push_back(folder.merge_script().string());
  return command;
}

SlurmJobs submit(const Campaign& campaign, const SlurmOptions& options, double trial_s,
                 const fs::path& program) {
  const auto missing = campaign.missing_blocks();
  std::int64_t trials = 0;
  for (const Block& block : missing) trials += block.size();
  SlurmJobs jobs;
  jobs.tasks =
      tasks_of(campaign.blocks(), missing, trials_of_a_task(options, trial_s, trials, max_tasks()));
  if (jobs.tasks.empty()) throw InputError("nothing is missing: there is nothing to submit");
  jobs.folder = new_folder(campaign);
  write_file(jobs.folder.tasks(), text_of(jobs.tasks));
  write_file(jobs.folder.script(), task_script(campaign, jobs.folder, options, program));
  write_file(jobs.folder.merge_script(), merge_script(campaign, options, program));
  const auto record = [&jobs] {
    write_file(jobs.folder.jobs(),
               json_text(ordered_json{{"array", jobs.array}, {"merge", jobs.merge}}) + "\n");
  };
  jobs.array = submitted(array_command(campaign, jobs.folder, options, jobs.tasks.size()));
  record();  // known to `cancel`, whatever comes now
  jobs.merge = submitted(merge_command(campaign, jobs.folder, options, jobs.array));
  record();
  return jobs;
}

std::optional<SlurmJobs> active_jobs(const Campaign& campaign) {
  auto jobs = last_jobs(campaign);
  if (!jobs || state_of(*jobs).over) return std::nullopt;
  return jobs;
}

SlurmState state_of(const SlurmJobs& jobs) {
  const std::string ids = jobs.merge.empty() ? jobs.array : jobs.array + "," + jobs.merge;
  const ProgramOutput output = slurm(
      {"squeue", "--jobs=" + ids, "--noheader", "--array", "--states=all", "--format=%i %T %r"});
  SlurmState state;
  if (!output.end.ok()) {
    if (output.errors.find("Invalid job id") == std::string::npos) {
      throw InputError("squeue: " + first_line(output.errors));
    }
    state.over = true;  // so long over that Slurm has forgotten them
    state.ended = jobs.tasks.size();
    return state;
  }
  bool merge_is_over = true;
  std::istringstream lines(output.text);
  std::string id, word, reason;
  while (lines >> id >> word && std::getline(lines, reason)) {
    if (id == jobs.merge) {
      merge_is_over = is_over(word);
    } else if (word == "PENDING") {
      ++state.waiting;
      const std::string why = reason.substr(std::min<std::size_t>(1, reason.size()));
      if (why != "None" && !why.empty()) state.reason = why;
    } else if (!is_over(word)) {
      ++state.running;
    }
  }
  state.ended = jobs.tasks.size() - std::min(jobs.tasks.size(), state.waiting + state.running);
  const bool array_is_over = state.waiting + state.running == 0;
  state.merging = array_is_over && !merge_is_over;
  state.over = array_is_over && merge_is_over;
  return state;
}

std::vector<SlurmFailure> failures_of(const Campaign& campaign, const SlurmJobs& jobs) {
  const auto blocks = campaign.blocks();
  std::vector<SlurmFailure> failures;
  for (std::size_t i = 0; i < jobs.tasks.size(); ++i) {
    const SlurmTask& task = jobs.tasks[i];
    const auto from = blocks.begin() + std::min<std::int64_t>(task.first, std::ssize(blocks));
    const auto to =
        blocks.begin() + std::min<std::int64_t>(task.first + task.count, std::ssize(blocks));
    const bool complete = std::all_of(
        from, to, [&](const Block& block) { return fs::exists(campaign.block_file(block)); });
    if (!complete) failures.push_back({i, reason_of(jobs, i), jobs.folder.log(i)});
  }
  return failures;
}

void cancel(const SlurmJobs& jobs) {
  std::vector<std::string> command = {"scancel", jobs.array};
  if (!jobs.merge.empty()) command.push_back(jobs.merge);
  const ProgramOutput output = slurm(command);
  if (!output.end.ok()) throw InputError("scancel: " + first_line(output.errors));
}

}  // namespace berth::campaigns
