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
#include "app/terminal/monitor.h"
#include "common/core/child_process.h"
#include "common/core/error.h"

namespace berth::commands {
namespace {

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
  auto directory = std::make_shared<std::filesystem::path>();
  auto observe = std::make_shared<bool>(false);
  command->add_option("run", *directory, "Run directory; the newest run when left out");
  command->add_flag("--observe", *observe, "Only look: nothing is sent, and Ctrl-C only leaves");
  command->callback([directory, observe, &exit_code] {
    exit_code = monitor(require_active_run(*directory), *observe);
  });
}

void add_stop(CLI::App& app, int& exit_code) {
  auto* command =
      app.add_subcommand("stop", "Abort the procedure that runs, or bring the cell down");
  auto directory = std::make_shared<std::filesystem::path>();
  auto now = std::make_shared<bool>(false);
  command->add_option("run", *directory, "Run directory; the newest run when left out");
  command->add_flag("--now", *now, "Do not wait for the procedure's teardown");
  command->callback(
      [directory, now, &exit_code] { exit_code = stop(require_active_run(*directory), *now); });
}

}  // namespace berth::commands
