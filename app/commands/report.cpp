// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/report.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/commands/run_options.h"
#include "app/exit_code.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  std::vector<std::string> runs;
  fs::path html = "report.html";
};

int write(const ReportOptions& options) {
  int worst = exit_code::passed;
  const std::vector<report::ReportedRun> runs = read_runs(options.runs, worst);
  if (runs.empty()) return worst;
  report::write_report(runs, options.html);
  std::printf("%s\n", options.html.c_str());
  return worst;
}

}  // namespace

void add_report(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "report", "berth compare --html: a run, or several side by side, as one HTML file");
  auto options = std::make_shared<ReportOptions>();
  command
      ->add_option("run", options->runs, "Run directories, logs, names of runs in runs/, or 'last'")
      ->required();
  command->add_option("--html", options->html, "File to write")->capture_default_str();
  command->callback([options, &exit_code] { exit_code = write(*options); });
}

}  // namespace berth::commands
