// SPDX-License-Identifier: BSD-3-Clause
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "app/attempt.h"
#include "app/batch/campaigns/report.h"
#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/runner.h"
#include "app/batch/campaigns/trial_store.h"
#include "app/batch/campaigns/vocabulary.h"
#include "app/batch/pool.h"
#include "app/commands/campaign_slurm.h"
#include "app/commands/cell_options.h"
#include "app/commands/commands.h"
#include "app/directory_lock.h"
#include "app/exit_code.h"
#include "app/runs/manifest.h"
#include "app/terminal/interruption.h"
#include "app/terminal/progress_line.h"
#include "common/core/error.h"
#include "common/core/shared_files.h"
#include "common/core/statistics.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;
using namespace campaigns;

struct CampaignOptions {
  fs::path manifest;
  fs::path out;
  std::int64_t trials = 0;
  int jobs = 0;
  std::string engine = "local";
  fs::path slurm;  // options of the cluster
  std::int64_t task_trials = 0;
  bool detach = false;
  bool list = false;
  // of the verbs
  fs::path directory;
  std::int64_t number = 0;
  std::int64_t count = 1;
};

RunnerCost run_here(const Campaign& campaign, const std::vector<Block>& blocks, int jobs) {
  terminal::watch_for_interruption();
  std::int64_t total = 0;
  for (const Block& block : blocks) total += block.size();
  terminal::ProgressLine progress("trials", total);
  RunnerOptions runner;
  runner.jobs = jobs;
  runner.make = [&campaign] { return make_experiment(campaign); };
  runner.report = [&progress](const RunnerProgress& now) {
    progress.show(static_cast<double>(now.done), std::to_string(now.workers) + " workers",
                  static_cast<double>(now.done - now.done_now));
  };
  runner.interrupted = terminal::interrupted;
  const RunnerCost cost = run_blocks(campaign, blocks, runner);
  progress.status("");
  if (cost.trials > 0) note_cost(campaign, cost, jobs);
  return cost;
}

constexpr std::size_t max_broken_listed = 10;
constexpr std::int64_t max_points_shown = 60;

void print_points(const Campaign& campaign) {
  const Manifest& manifest = campaign.manifest();
  const auto points = static_cast<std::size_t>(manifest.points());
  std::vector<std::vector<TrialResult>> of_point(points);
  for_each_trial(manifest, campaign.results_file(), [&](const TrialResult& result) {
    of_point[static_cast<std::size_t>(result.point)].push_back(result);
  });
  Table table{std::string(manifest.grid.size(), 'l')};
  for (const Parameter& axis : manifest.grid) table.head.push_back(axis.name);
  table.head.insert(table.head.end(), {"trials", "passed"});
  for (const KeptMeasurement& kept : manifest.measurements) {
    table.head.push_back(kept.name + (kept.unit.empty() ? "" : ", " + kept.unit));
  }
  for (const auto& of : of_point) {
    if (of.empty()) continue;
    auto& line = table.rows.emplace_back().cells;
    const auto passed =
        std::count_if(of.begin(), of.end(), [](const auto& r) { return r.passed(); });
    for (std::size_t axis = 0; axis < manifest.grid.size(); ++axis) {
      line.push_back(of.front().parameters[axis].second);
    }
    line.push_back(of.size());
    line.push_back(fixed(100.0 * static_cast<double>(passed) / static_cast<double>(of.size()), 2) +
                   " %");
    for (const KeptMeasurement& kept : manifest.measurements) {
      std::vector<double> values;
      for (const TrialResult& r : of) values.push_back(r.measurement(kept.name));
      line.push_back(shown(median(finite(std::move(values)))));
    }
  }
  std::printf("%s  (medians of the trials)\n\n", text_table(table).c_str());
}

/// Each point of the grid, failures by kind, what is broken or missing.
void print_summary(const Campaign& campaign, const Summary& summary) {
  if (summary.present > 0 && campaign.manifest().points() <= max_points_shown) {
    print_points(campaign);
  }
  std::printf("%lld of %lld trials", static_cast<long long>(summary.present),
              static_cast<long long>(summary.trials));
  for (const auto& [outcome, count] : summary.outcomes) {
    std::printf(", %lld %s", static_cast<long long>(count), name_of(outcome));
  }
  std::printf("\n");
  for (const auto& [failure, count] : summary.failures) {
    std::printf("  %6lld  %s\n", static_cast<long long>(count), terminal_line(failure).c_str());
  }
  if (!summary.broken.empty()) {
    std::printf("crashed or in error: trial");
    for (std::size_t i = 0; i < std::min(max_broken_listed, summary.broken.size()); ++i) {
      std::printf(" %lld", static_cast<long long>(summary.broken[i]));
    }
    std::printf("%s\n",
                summary.broken.size() > max_broken_listed ? " ... (all in summary.json)" : "");
  }
  if (!summary.missing.empty()) {
    std::printf("missing: %zu blocks, from trial %lld on; the same command goes on\n",
                summary.missing.size(), static_cast<long long>(summary.missing.front().begin));
  }
  std::printf("campaign %s\n", campaign.directory().c_str());
}

/// Merges the results that are there, draws the report and prints the summary.
Summary conclude(const Campaign& campaign) {
  const Summary summary = merge(campaign);
  if (summary.present > 0) {
    attempt([&] { write_report(campaign.manifest(), campaign.directory()); });
  }
  attempt([&] { write_checksums(campaign.directory()); });
  print_summary(campaign, summary);
  return summary;
}

int exit_code_of(const Summary& summary) {
  int code = summary.broken.empty() ? exit_code::passed : exit_code::failed;
  if (!summary.complete()) code = exit_code::worst(code, exit_code::error);
  if (terminal::interrupted()) code = exit_code::worst(code, exit_code::aborted);
  return code;
}

SlurmEnd run_cluster(const Campaign& campaign, const CampaignOptions& options,
                     std::function<void()> submitted) {
  terminal::watch_for_interruption();
  SlurmRequest request;
  request.options = options.slurm;
  request.task_trials = options.task_trials;
  request.detach = options.detach;
  request.run_here = [&campaign](const std::vector<Block>& blocks) {
    run_here(campaign, blocks, 1);
  };
  request.interrupted = terminal::interrupted;
  request.submitted = std::move(submitted);
  return run_on_slurm(campaign, request);
}

int run_campaign(const CampaignOptions& options) {
  const Manifest manifest = load_manifest(here_or_shipped(options.manifest));
  const fs::path out =
      options.out.empty() ? fs::path("campaign-runs") / manifest.name : options.out;
  Campaign::require_place(out);
  std::optional<DirectoryLock> lock(out);
  const Campaign campaign = Campaign::create(manifest, out, options.trials);
  print_notes(manifest.notes, options.manifest.string());
  std::vector<CampaignTarget> targets = manifest.targets;
  if (targets.empty()) targets = {{"", manifest.places.target, manifest.target_length}};
  for (const CampaignTarget& target : targets) {
    if (target.place.empty()) continue;
    print_notes(target_notes(load_target(target.place, target.length)), target.place);
  }
  std::printf("campaign %s: %lld points, %lld trials each\n", campaign.directory().c_str(),
              static_cast<long long>(campaign.manifest().points()),
              static_cast<long long>(campaign.manifest().trials));
  std::fflush(stdout);
  RunnerCost cost;
  if (options.engine == "slurm") {
    // Not while the cluster is waited for: its last job merges.
    const SlurmEnd end = run_cluster(campaign, options, [&lock] { lock.reset(); });
    if (end == SlurmEnd::detached) return exit_code::passed;
    if (end == SlurmEnd::interrupted) return exit_code::aborted;
    if (!lock) lock.emplace(out, DirectoryLock::Busy::wait);
  } else {
    cost = run_here(campaign, campaign.missing_blocks(), jobs_of(options.jobs));
  }
  const Summary summary = conclude(campaign);
  if (cost.trials > 0) std::printf("%s\n", text_of(cost).c_str());
  return exit_code_of(summary);
}

int run_block_numbers(const CampaignOptions& options) {
  const Campaign campaign = Campaign::open(options.directory);
  campaign.require_this_build();
  const auto all = campaign.blocks();
  if (options.number < 0 || options.number >= std::ssize(all)) {
    throw InputError("block " + std::to_string(options.number) + ": expected 0 to " +
                     std::to_string(std::ssize(all) - 1));
  }
  const auto first = all.begin() + options.number;
  const auto last = first + std::min(options.count, std::int64_t{std::distance(first, all.end())});
  const RunnerCost cost = run_here(campaign, {first, last}, std::max(1, options.jobs));
  if (cost.trials > 0) std::printf("%s\n", text_of(cost).c_str());
  return terminal::interrupted() ? exit_code::aborted : exit_code::passed;
}

int run_trial_again(const CampaignOptions& options) {
  const Campaign campaign = Campaign::open(options.directory);
  const std::int64_t last = campaign.manifest().total() - 1;
  if (options.number < 0 || options.number > last) {
    throw InputError("trial " + std::to_string(options.number) + ": expected 0 to " +
                     std::to_string(last));
  }
  const Trial trial = trial_of(campaign.manifest(), options.number);
  const fs::path out = options.out.empty()
                           ? campaign.directory() / "again" / std::to_string(options.number)
                           : options.out;
  const DirectoryLock lock(campaign.directory() / "again");
  if (fs::exists(out)) throw InputError(out.string() + ": is there; choose another --out");
  const TrialResult result = make_experiment(campaign)->run_again(trial, out);
  std::printf("%s\n%s\n", line_of(result).c_str(), out.c_str());
  if (result.outcome == Outcome::error) return exit_code::error;
  return result.passed() ? exit_code::passed : exit_code::failed;
}

void add_directory(CLI::App& verb, CampaignOptions& options) {
  verb.add_option("directory", options.directory, "The campaign's directory")->required();
}

void add_verbs(CLI::App& campaign, const std::shared_ptr<CampaignOptions>& options,
               int& exit_code) {
  auto* trial = campaign.add_subcommand(
      "trial", "Run one trial again, alone, and keep its run directory or its scan");
  add_directory(*trial, *options);
  trial->add_option("trial", options->number, "Its number")->required();
  trial->add_option("--out", options->out, "Where; default: again/NUMBER in the campaign");
  trial->callback([options, &exit_code] { exit_code = run_trial_again(*options); });

  auto* block = campaign.add_subcommand("block",
                                        "Run some blocks of a campaign: what a cluster's "
                                        "job does. Merges nothing");
  add_directory(*block, *options);
  block->add_option("number", options->number, "The first block's number")->required();
  block->add_option("--count", options->count, "How many")->check(CLI::PositiveNumber);
  block->add_option("--jobs", options->jobs, "Worker processes (default: 1)");
  block->callback([options, &exit_code] { exit_code = run_block_numbers(*options); });

  auto* cancel = campaign.add_subcommand("cancel", "End the campaign's jobs on the cluster");
  add_directory(*cancel, *options);
  cancel->callback([options] { cancel_on_slurm(Campaign::open(options->directory)); });

  auto* report = campaign.add_subcommand("report", "Draw the merged results again: report.html");
  add_directory(*report, *options);
  report->callback([options] {
    const Campaign one = Campaign::open(options->directory);
    const DirectoryLock lock(one.directory());
    write_report(one.manifest(), one.directory());
    write_checksums(one.directory());
    std::printf("%s\n", one.report_file().c_str());
  });

  auto* join = campaign.add_subcommand("merge", "Join the results that are there");
  add_directory(*join, *options);
  join->callback([options, &exit_code] {
    const Campaign one = Campaign::open(options->directory);
    const DirectoryLock lock(one.directory());
    exit_code = exit_code_of(conclude(one));
  });
}

}  // namespace

void add_campaign(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "campaign",
      "Run an experiment many times under swept and drawn conditions; see docs/campaigns.md.\n"
      "Exit codes: 0 all trials have a result, 1 some crashed or ended in an error, 2 the input "
      "was\n"
      "at fault or results are missing, 3 interrupted (the same command goes on).");
  auto options = std::make_shared<CampaignOptions>();
  command->add_option("campaign", options->manifest,
                      "Campaign, e.g. procedures/campaigns/acquisition.yaml");
  command->add_option("--trials", options->trials, "At each point, instead of the campaign's own")
      ->check(CLI::PositiveNumber);
  command->add_option("--jobs", options->jobs, "Worker processes (default: one per core)")
      ->check(CLI::PositiveNumber);
  command->add_option("--engine", options->engine, "Where the trials run")
      ->check(CLI::IsMember({"local", "slurm"}))
      ->capture_default_str();
  command
      ->add_option("--slurm", options->slurm,
                   "File of options for the cluster: partition, time, memory ...; see "
                   "docs/campaigns.md")
      ->check(CLI::ExistingFile)
      ->envname("BERTH_SLURM");
  command
      ->add_option("--block", options->task_trials,
                   "Trials of one task on the cluster; left out: as many as its `task` takes")
      ->check(CLI::PositiveNumber);
  command->add_flag("--detach", options->detach,
                    "Leave when the cluster has the jobs; the same command waits for them");
  command->add_option("--out", options->out,
                      "The campaign's directory (default: campaign-runs/NAME); one that is there "
                      "goes on where it was");
  command->add_flag("--list", options->list,
                    "Print the parameters and measurements of an acquisition");
  command->require_subcommand(0, 1);
  add_verbs(*command, options, exit_code);
  command->callback([command, options, &exit_code] {
    if (!command->get_subcommands().empty()) return;
    if (options->list) {
      std::printf("%s", describe_acquisition().c_str());
      return;
    }
    if (options->manifest.empty()) throw InputError("berth campaign: no CAMPAIGN.yaml given");
    exit_code = run_campaign(*options);
  });
}

}  // namespace berth::commands
