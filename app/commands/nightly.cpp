// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/batch/nights/night.h"
#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/run_files.h"
#include "common/core/error.h"
#include "common/core/shared_files.h"

namespace berth::commands {

void add_nightly(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "nightly",
      "Run a plan of procedures and seeds, compare with the nights before and with a baseline "
      "build.\nExit codes: 0 clean, 1 a regression or too many failures, 2 the rig or the input "
      "was at fault,\n3 interrupted (the same command goes on).");
  auto request = std::make_shared<nights::NightRequest>();
  auto accept = std::make_shared<std::string>();
  command->add_option("plan", request->plan,
                      "Plan, e.g. procedures/nights/nightly.yaml; see docs/nightly.md");
  command
      ->add_option("--out", request->out, "Directory of the history, the index page and the nights")
      ->capture_default_str();
  command
      ->add_option("--baseline", request->baseline,
                   "Another build's berth, run on the same seeds, instead of the plan's")
      ->envname("BERTH_BASELINE");
  command->add_option("--config", request->config,
                      "Configuration directory of tonight's runs, where the plan names none");
  command
      ->add_option("--jobs", request->jobs, "Runs at a time (default: the plan's, or one per core)")
      ->check(CLI::PositiveNumber);
  command->add_option("--night", request->name, "Name of the night instead of the date");
  command->add_flag("--new", request->afresh, "Begin a new night even if one was interrupted");
  command
      ->add_option("--accept", *accept,
                   "Take the changes of this finished night for good: later nights compare "
                   "with it; runs nothing")
      ->type_name("NIGHT");
  command->callback([request, accept, &exit_code] {
    if (!accept->empty()) {
      nights::accept_night(request->out, *accept);
      std::printf("night %s is accepted: the nights that follow compare with it\n",
                  accept->c_str());
      return;
    }
    if (request->plan.empty()) throw InputError("berth nightly: no PLAN.yaml given");
    request->plan = here_or_shipped(request->plan);
    request->program = program_directory() / "berth";
    exit_code = nights::run_night(*request);
  });
}

}  // namespace berth::commands
