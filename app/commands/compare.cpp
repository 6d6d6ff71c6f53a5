// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/run_list.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "logs/compare/beside.h"
#include "logs/compare/comparison.h"
#include "logs/report/report.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct CompareOptions {
  std::vector<std::string> runs;
  bool list = false;
  bool json = false;
  fs::path html;
};

/// One run in JSON is an object; several are {"runs": [...], "measurements": [...]}.
void print_beside(const std::vector<report::ReportedRun>& runs, bool json) {
  if (runs.size() == 1) {
    std::printf("%s\n", logs::json_of(runs.front().run.comparison).c_str());
    return;
  }
  std::vector<logs::Measurer> measurers;
  for (const auto& run : runs) measurers.emplace_back(run.run.record, run.run.nearest);
  std::vector<const logs::Measurer*> pointers;
  for (const auto& measurer : measurers) pointers.push_back(&measurer);
  const auto rows = logs::lay_beside(pointers);
  std::vector<std::string> names;
  for (const auto& run : runs) names.push_back(run.name());
  if (!json) {
    print_text(logs::text_of_beside(names, rows));
    return;
  }
  std::string list;
  for (const auto& run : runs) {
    list += (list.empty() ? "" : ",\n") + logs::json_of(run.run.comparison);
  }
  std::printf("{\"runs\": [\n%s],\n\"measurements\": %s}\n", list.c_str(),
              logs::json_of_beside(rows).c_str());
}

int compare(const CompareOptions& options) {
  if (options.list) std::printf("%s", logs::describe_measurements().c_str());
  if (options.list && options.runs.empty()) return exit_code::passed;
  if (options.runs.empty()) {
    throw InputError("berth compare: expected run directories or logs, or --list");
  }
  int worst = exit_code::passed;
  std::vector<report::ReportedRun> runs;
  for (const auto& run : options.runs) {
    runs.push_back(report::read_reported_run(find_run(run)));
    const logs::Comparison& comparison = runs.back().run.comparison;
    if (!options.json) print_text(logs::text_of(comparison) + "\n");
    worst = std::max(worst, logs::exit_code_of_outcome(comparison.outcome));
  }
  if (runs.size() > 1 || options.json) print_beside(runs, options.json);
  if (!options.html.empty()) report::write_report(runs, options.html);
  return worst;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "compare", "Compare estimates with ground truth and recompute the verdict, from a log alone");
  auto options = std::make_shared<CompareOptions>();
  command->add_option("run", options->runs,
                      "Run directories, logs, names of runs in runs/, or 'last'");
  command->add_flag("--list", options->list, "List what can be measured, with units");
  command->add_flag("--json", options->json, "JSON instead of tables");
  command->add_option("--html", options->html,
                      "Write a report into this file: one run, or several beside each other");
  command->callback([options, &exit_code] { exit_code = compare(*options); });
}

}  // namespace berth::commands
