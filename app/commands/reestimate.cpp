// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <memory>

#include "app/batch/reestimation/batch.h"
#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/terminal/progress_line.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "evaluation/compare/change.h"

namespace berth::commands {
namespace {

struct ReestimateOptions {
  BatchRequest request;
  bool json = false;
  bool fail_on_worse = false;
};

double per(double amount, double time) { return time > 0 ? amount / time : 0; }

nlohmann::ordered_json json_of(const BatchRun& run) {
  nlohmann::ordered_json json = {{"recorded", run.recorded.string()},
                                 {"again", run.again.string()}};
  if (!run.error.empty()) {
    json["error"] = run.error;
    return json;
  }
  const Reestimation& r = run.result;
  json["estimates_recorded"] = r.recorded;
  json["estimates"] = r.estimates;
  json["estimates_same"] = r.same;
  json["recorded_s"] = r.recorded_s;
  json["change"] = evaluation::json_of(run.change);
  json["wall_s"] = r.wall_s;
  json["estimator_s"] = r.estimator_s;
  return json;
}

void print_json(const Batch& batch, const ReestimateOptions& options) {
  nlohmann::ordered_json json;
  json["config"] = options.request.changes.config.string();
  json["set"] = options.request.changes.set;
  json["level"] = options.request.level;
  json["identical"] = batch.identical();
  json["change"] = evaluation::json_of(batch.change);
  for (const BatchRun& run : batch.runs) json["runs"].push_back(json_of(run));
  std::printf("%s\n", json_text(json, 2).c_str());
}

void print_batch(const Batch& batch, const ReestimateOptions& options) {
  Reestimation all;
  for (const BatchRun& run : batch.runs) {
    if (!run.error.empty()) continue;
    const Reestimation& r = run.result;
    std::printf("%s\n  again: %s\n  %" PRId64 " estimates recorded, %" PRId64 " again, %" PRId64
                " the same; %s\n",
                run.recorded.c_str(), run.again.c_str(), r.recorded, r.estimates, r.same,
                r.identical() ? "identical" : run.change.verdict().c_str());
    all.estimates += r.estimates;
    all.recorded_s += r.recorded_s;
    all.wall_s += r.wall_s;
    all.estimator_s += r.estimator_s;
  }
  if (all.wall_s == 0) return;
  std::printf(
      "%.0f estimates/s, %.0f times real time on one core, %.0f %% of it in the estimator\n\n",
      per(static_cast<double>(all.estimates), all.wall_s), per(all.recorded_s, all.wall_s),
      100 * per(all.estimator_s, all.wall_s));
  if (batch.identical()) {
    std::printf("all estimates are identical to the recorded ones\n");
  } else {
    print_text(evaluation::text_of(batch.change, options.request.level));
  }
}

int reestimate(const ReestimateOptions& options) {
  Batch batch;
  {
    terminal::ProgressLine progress("estimated again");
    batch = berth::reestimate(options.request, [&](double share) { progress.show(share); });
  }
  options.json ? print_json(batch, options) : print_batch(batch, options);
  for (const BatchRun& run : batch.runs) {
    if (run.error.empty()) continue;
    print_text("berth: " + run.recorded.string() + ": " + run.error + "\n", stderr);
  }
  const bool worse = options.fail_on_worse && batch.change.any(evaluation::Judgement::worse);
  return exit_code::worst(worse ? exit_code::failed : exit_code::passed,
                          batch.failed() ? exit_code::error : exit_code::passed);
}

}  // namespace

void add_reestimate(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "reestimate",
      "Run the estimator over recorded scans, with another configuration, and compare");
  auto options = std::make_shared<ReestimateOptions>();
  BatchRequest& request = options->request;
  request.out = "reestimated";
  command
      ->add_option("run", request.runs, "Run directories, logs, names of runs in runs/, or 'last'")
      ->required();
  command->add_option("--config", request.changes.config,
                      "An estimator.yaml, or a configuration directory with one (its lidars/ are "
                      "taken too); as recorded when left out");
  command
      ->add_option("--set", request.changes.set,
                   "A key of estimator.yaml, e.g. tracking.method=icp")
      ->type_name("KEY=VALUE");
  command
      ->add_option("--out", request.out,
                   "New run directories and results.sqlite are made under this directory")
      ->capture_default_str();
  command->add_option("--jobs", request.jobs, "Runs at a time; 0: one per processor")
      ->capture_default_str();
  command->add_option("--level", request.level, "Chance of any false alarm in the table")
      ->check(CLI::Range(1e-4, 0.5))
      ->capture_default_str();
  command->add_flag("--json", options->json, "JSON instead of tables");
  command->add_flag("--fail-on-worse", options->fail_on_worse,
                    "Exit with 1 when anything became worse");
  command->callback([options, &exit_code] { exit_code = reestimate(*options); });
}

}  // namespace berth::commands
