// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/campaign_slurm.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/slurm.h"
#include "app/runs/run_files.h"
#include "app/terminal/progress_line.h"
#include "common/core/error.h"
#include "common/core/text.h"

namespace berth::commands {
namespace {

using namespace campaigns;
using Clock = std::chrono::steady_clock;

constexpr auto between_questions = std::chrono::seconds(2);
constexpr auto patience = std::chrono::minutes(5);
constexpr std::size_t max_failures_listed = 10;

double trial_time(const Campaign& campaign, const SlurmRequest& request,
                  const SlurmOptions& options) {
  if (options.trial_s > 0 || options.task_trials > 0) return options.trial_s;
  const auto trial_s = [&campaign]() -> std::optional<double> {
    const CampaignCost cost = campaign_cost(campaign.directory());
    if (!(cost.trials > 0)) return std::nullopt;
    return cost.processor_s / cost.trials;
  };
  if (const auto known = trial_s()) return *known;
  const auto missing = campaign.missing_blocks();
  std::printf("measuring the time of a trial on %lld trials here\n",
              static_cast<long long>(missing.front().size()));
  std::fflush(stdout);
  request.run_here({missing.front()});
  return trial_s().value_or(1);
}

std::string text_of(const SlurmState& state, std::size_t tasks) {
  if (state.merging) return "all tasks have ended, merging";
  std::string text = std::to_string(state.ended) + " of " + std::to_string(tasks) +
                     " tasks ended, " + std::to_string(state.running) + " running, " +
                     std::to_string(state.waiting) + " waiting";
  if (state.waiting > 0 && !state.reason.empty()) text += " (" + state.reason + ")";
  return text;
}

std::int64_t missing_trials(const Campaign& campaign) {
  std::int64_t missing = 0;
  for (const Block& block : campaign.missing_blocks()) missing += block.size();
  return missing;
}

/// False: interrupted.
bool wait_for(const Campaign& campaign, const SlurmJobs& jobs,
              const std::function<bool()>& interrupted) {
  const std::int64_t total = campaign.manifest().total();
  terminal::ProgressLine progress("trials", total);
  const auto before = static_cast<double>(total - missing_trials(campaign));
  auto answered = Clock::now();
  while (true) {
    try {
      const SlurmState state = state_of(jobs);
      answered = Clock::now();
      progress.show(static_cast<double>(total - missing_trials(campaign)),
                    text_of(state, jobs.tasks.size()), before);
      if (state.over) return true;
    } catch (const InputError&) {
      // The scheduler may be restarted while jobs run.
      if (Clock::now() - answered > patience) throw;
    }
    for (const auto until = Clock::now() + between_questions; Clock::now() < until;) {
      if (interrupted()) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
}

void report_failures(const Campaign& campaign, const SlurmJobs& jobs) {
  const auto failures = failures_of(campaign, jobs);
  for (std::size_t i = 0; i < std::min(max_failures_listed, failures.size()); ++i) {
    std::printf("task %zu left trials undone: %s; see %s\n", failures[i].task,
                failures[i].reason.c_str(), failures[i].log.c_str());
  }
  if (failures.size() > max_failures_listed) {
    std::printf("and %zu other tasks\n", failures.size() - max_failures_listed);
  }
}

/// Nothing when the trials that were measured were the last ones.
std::optional<SlurmJobs> submit_missing(const Campaign& campaign, const SlurmRequest& request) {
  SlurmOptions options;
  if (!request.options.empty()) options = load_slurm_options(request.options);
  if (request.task_trials > 0) options.task_trials = request.task_trials;
  const double trial_s = trial_time(campaign, request, options);
  if (request.interrupted() || campaign.missing_blocks().empty()) return std::nullopt;
  const SlurmJobs jobs = submit(campaign, options, trial_s, program_directory() / "berth");
  std::printf("submitted job %s: %zu tasks of about %lld trials", jobs.array.c_str(),
              jobs.tasks.size(), static_cast<long long>(jobs.tasks.front().trials));
  if (trial_s > 0) {
    std::printf(" (%s s of processor time)",
                shown(trial_s * static_cast<double>(jobs.tasks.front().trials)).c_str());
  }
  std::printf(", and job %s that merges; their files: %s\n", jobs.merge.c_str(),
              jobs.folder.path.c_str());
  std::fflush(stdout);
  return jobs;
}

}  // namespace

SlurmEnd run_on_slurm(const Campaign& campaign, const SlurmRequest& request) {
  auto jobs = active_jobs(campaign);
  if (jobs) {
    std::printf("job %s of this campaign is at work already\n", jobs->array.c_str());
  } else {
    if (campaign.missing_blocks().empty()) return SlurmEnd::over;
    jobs = submit_missing(campaign, request);
    if (!jobs) return request.interrupted() ? SlurmEnd::interrupted : SlurmEnd::over;
  }
  const std::string hint = "`berth campaign cancel " + campaign.directory().string() + "` ends it";
  if (request.detach) {
    std::printf("the same command waits for it, %s\n", hint.c_str());
    return SlurmEnd::detached;
  }
  if (request.submitted) request.submitted();
  if (!wait_for(campaign, *jobs, request.interrupted)) {
    std::printf("job %s goes on; the same command waits for it, %s\n", jobs->array.c_str(),
                hint.c_str());
    return SlurmEnd::interrupted;
  }
  report_failures(campaign, *jobs);
  return SlurmEnd::over;
}

void cancel_on_slurm(const Campaign& campaign) {
  const auto jobs = active_jobs(campaign);
  if (!jobs) {
    std::printf("no job of this campaign is at work\n");
    return;
  }
  cancel(*jobs);
  std::printf("job %s is cancelled; what is finished stays, the same command goes on\n",
              jobs->array.c_str());
}

}  // namespace berth::commands
