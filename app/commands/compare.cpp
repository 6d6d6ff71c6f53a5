// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/run_list.h"
#include "app/terminal/terminal_view.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "evaluation/compare/comparison.h"
#include "evaluation/compare/side_by_side.h"
#include "evaluation/report/report.h"
#include "evaluation/report/reported_run.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct CompareOptions {
  std::vector<std::string> runs;
  bool list = false;
  bool measurements = false;
  bool json = false;
  fs::path html;
};

/// The runs that a user names (see find_run), judged from their logs: of a log all that it holds.
/// Unreadable ones are reported on standard error; the others are still judged.
/// @param worst exit code, made worse by each run and by what cannot be read
std::vector<report::ReportedRun> read_runs(const std::vector<std::string>& names, int& worst) {
  std::vector<report::ReportedRun> runs;
  for (const std::string& name : names) {
    try {
      const fs::path found = find_run(name);
      const bool is_directory = fs::is_directory(found);
      for (report::ReportedRun& run :
           report::read_reported_runs(log_of_run(name), is_directory ? found : "")) {
        worst =
            exit_code::worst(worst, evaluation::exit_code_of_outcome(run.run.comparison.outcome));
        runs.push_back(std::move(run));
      }
    } catch (const std::exception& e) {
      std::fprintf(stderr, "berth: %s\n", e.what());
      worst = exit_code::worst(worst, exit_code::error);
    }
  }
  return runs;
}

/// One run in JSON is an object; several are {"runs": [...], "measurements": [...]}.
void print_side_by_side(const std::vector<report::ReportedRun>& runs, bool json) {
  if (runs.size() == 1) {
    std::printf("%s\n", evaluation::json_of(runs.front().run.comparison).c_str());
    return;
  }
  std::vector<evaluation::Measurer> measurers;
  for (const auto& run : runs) measurers.emplace_back(run.run.record, run.run.nearest);
  std::vector<const evaluation::Measurer*> pointers;
  for (const auto& measurer : measurers) pointers.push_back(&measurer);
  const auto rows = evaluation::compare_side_by_side(pointers);
  std::vector<std::string> names;
  for (const auto& run : runs) names.push_back(run.name());
  if (!json) {
    print_text(evaluation::text_of_side_by_side(names, rows));
    return;
  }
  std::string list;
  for (const auto& run : runs) {
    list += (list.empty() ? "" : ",\n") + evaluation::json_of(run.run.comparison);
  }
  std::printf("{\"runs\": [\n%s],\n\"measurements\": %s}\n", list.c_str(),
              evaluation::json_of_side_by_side(rows).c_str());
}

int compare(const CompareOptions& options) {
  if (options.list && options.json) {
    print_table(evaluation::measurement_table(), true);
  } else if (options.list) {
    std::printf("%s", evaluation::describe_measurements().c_str());
  }
  if (options.list && options.runs.empty()) return exit_code::passed;
  if (options.runs.empty()) {
    throw InputError("berth compare: expected run directories or logs, or --list");
  }
  int worst = exit_code::passed;
  const std::vector<report::ReportedRun> runs = read_runs(options.runs, worst);
  for (const report::ReportedRun& run : runs) {
    if (options.json) break;
    const evaluation::Comparison& comparison = run.run.comparison;
    print_text(evaluation::heading_of(comparison));
    if (options.measurements) print_text(evaluation::measurements_text(comparison));
    std::fflush(stdout);
    terminal::print_verdict(evaluation::verdict_text(comparison) + "\n");
  }
  if (runs.empty()) return worst;
  // the procedures of one cell are not runs of one thing
  const bool side_by_side = options.runs.size() > 1 && runs.size() > 1;
  if (side_by_side || options.json) print_side_by_side(runs, options.json);
  if (!options.html.empty()) report::write_report(runs, options.html);
  return worst;
}

int write_html(const std::vector<std::string>& names, const fs::path& html) {
  int worst = exit_code::passed;
  const std::vector<report::ReportedRun> runs = read_runs(names, worst);
  if (runs.empty()) return worst;
  report::write_report(runs, html);
  std::printf("%s\n", html.c_str());
  return worst;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "compare", "Compare estimates with ground truth and recompute the verdict, from a log alone");
  auto options = std::make_shared<CompareOptions>();
  command->add_option("run", options->runs,
                      "Run directories, logs, names of runs in runs/, or 'last'");
  command->add_flag("--measurements", options->measurements,
                    "Every measurement of every phase, and the latencies, before the verdict");
  command->add_flag("--list", options->list, "List what can be measured, with units");
  command->add_flag("--json", options->json, "JSON instead of tables");
  command->add_option("--html", options->html,
                      "Write a report into this file: one run, or several side by side");
  command->callback([options, &exit_code] { exit_code = compare(*options); });
}

void add_report(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "report", "berth compare --html: a run, or several side by side, as one HTML file");
  auto options = std::make_shared<CompareOptions>();
  options->html = "report.html";
  command
      ->add_option("run", options->runs, "Run directories, logs, names of runs in runs/, or 'last'")
      ->required();
  command->add_option("--html", options->html, "File to write")->capture_default_str();
  command->callback(
      [options, &exit_code] { exit_code = write_html(options->runs, options->html); });
}

}  // namespace berth::commands
