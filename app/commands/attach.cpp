// SPDX-License-Identifier: BSD-3-Clause
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/active_runs.h"
#include "app/runs/run_list.h"
#include "app/terminal/monitor.h"
#include "common/core/child_process.h"
#include "common/core/error.h"

namespace berth::commands {
namespace {

/// The newest where nothing is named.
ActiveRun active_run(const std::string& name) {
  return require_active_run(name.empty() ? "" : directory_of_run(name));
}

using namespace std::chrono_literals;

/// A second SIGTERM ends it at once.
int stop(const ActiveRun& run, bool now) {
  std::printf("stopping %s\n", run.directory.c_str());
  const ProcessHandle supervisor(run.supervisor);
  // The lock is held still: the handle is the supervisor's, not that of a later process.
  if (!is_active(run)) return exit_code::passed;
  supervisor.signal(SIGTERM);
  if (now && !supervisor.ends_within(300ms)) supervisor.signal(SIGTERM);
  if (supervisor.ends_within(90s)) return exit_code::passed;
  std::fprintf(stderr, "berth: process %d does not end\n", run.supervisor);
  return exit_code::error;
}

}  // namespace

void add_attach(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("attach", "Show a running procedure in this terminal");
  auto run = std::make_shared<std::string>();
  auto observe = std::make_shared<bool>(false);
  command->add_option("run", *run,
                      "Run directory, or name of a run in runs/; the newest when left out");
  command->add_flag("--observe", *observe, "Only look: nothing is sent, and Ctrl-C only leaves");
  command->callback(
      [run, observe, &exit_code] { exit_code = monitor(active_run(*run), *observe); });
}

void add_stop(CLI::App& app, int& exit_code) {
  auto* command =
      app.add_subcommand("stop", "Abort the procedure that runs, or bring the cell down");
  auto run = std::make_shared<std::string>();
  auto now = std::make_shared<bool>(false);
  command->add_option("run", *run,
                      "Run directory, or name of a run in runs/; the newest when left out");
  command->add_flag("--now", *now, "Do not wait for the procedure's teardown");
  command->callback([run, now, &exit_code] { exit_code = stop(active_run(*run), *now); });
}

}  // namespace berth::commands
