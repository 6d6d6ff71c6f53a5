// SPDX-License-Identifier: BSD-3-Clause
#include "logs/report/report.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/run_list.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  std::vector<std::string> runs;
  fs::path html = "report.html";
};

int write(const ReportOptions& options) {
  std::vector<report::ReportedRun> runs;
  int worst = exit_code::passed;
  for (const std::string& run : options.runs) {
    runs.push_back(report::read_reported_run(find_run(run)));
    worst = std::max(worst, logs::exit_code_of_outcome(runs.back().run.comparison.outcome));
  }
  report::write_report(runs, options.html);
  std::printf("%s\n", options.html.c_str());
  return worst;
}

}  // namespace

void add_report(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "report", "berth compare --html: a run, or several beside each other, as one HTML file");
  auto options = std::make_shared<ReportOptions>();
  command
      ->add_option("run", options->runs, "Run directories, logs, names of runs in runs/, or 'last'")
      ->required();
  command->add_option("--html", options->html, "File to write")->capture_default_str();
  command->callback([options, &exit_code] { exit_code = write(*options); });
}

}  // namespace berth::commands
