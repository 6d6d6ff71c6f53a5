// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/slurm.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

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
    std::string said = output.errors;
    while (!said.empty() && said.back() == '\n') said.pop_back();
    throw InputError("sbatch refused the jobs: " + said + "\n  " + shown);
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
    return "it says that it did everything: is " + jobs.folder.path.string() +
           " the same on all machines?";
  }
  const std::string state = state_of_task(jobs, task);
  return state.empty() ? "it left no exit code: killed, or its machine failed" : state;
}

}  // namespace

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
