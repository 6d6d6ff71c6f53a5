// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>

#include "app/commands/cell_options.h"
#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/arms_now.h"
#include "app/runs/choose_setup.h"
#include "app/runs/config_override.h"
#include "common/core/shared_files.h"
#include "common/core/valid_text.h"
#include "procedures/check/check.h"

namespace berth::commands {
namespace {

/// Runs berth check before anything starts and prints its findings. @return whether the run may
/// start.
bool passes_check(const RunRequest& request) {
  const auto procedure =
      procedures::load_procedure(request.procedure, of_procedure(request.parameters));
  std::optional<ChangedConfiguration> changed;
  std::optional<testbed::ArmPair> start;
  RunSetup setup;
  if (request.joins.empty()) {
    setup = choose_setup({request.config, request.layout, request.target, request.target_length},
                         &procedure);
    setup.config =
        changed.emplace(setup.config, request.parameters, setup.layout, request.calibration)
            .directory();
  } else {
    setup = RunFiles::open(request.joins).setup;
    start = arms_now(request.url, setup.session);
  }
  const auto report = procedures::check_procedure(procedure, setup, start);
  for (const procedures::Finding& finding : report.findings) {
    if (finding.severity == procedures::Severity::note) continue;
    print_text(procedures::text_of(finding) + "\n", stderr);
  }
  if (!report.good()) {
    std::fprintf(stderr, "berth: nothing was started; --no-check runs it all the same\n");
  }
  return report.good();
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("run", "Run a procedure to its verdict");
  auto options = std::make_shared<CellOptions>();
  command
      ->add_option("procedure", options->request.procedure,
                   "Procedure, e.g. procedures/approach.yaml")
      ->required();
  add_twin_options(*command, *options);
  command->add_flag("--no-check", options->no_check,
                    "Start although berth check may have something against it");
  command
      ->add_option("--answer", options->answers,
                   "In the twin: the answer to a prompt, by its id or its step's name; without one "
                   "the prompt's own "
                   "standard answer is taken when its time is up")
      ->type_name("ID=TEXT");
  add_cell_options(*command, *options);
  command->callback([options, &exit_code] {
    options->request.procedure = here_or_shipped(options->request.procedure);
    complete(*options);
    if (!options->no_check && !passes_check(options->request)) {
      exit_code = exit_code::error;
      return;
    }
    const RunFiles files = RunFiles::create(options->request);
    exit_code = options->twin ? run_in_twin(files, assignments_of("--answer", options->answers))
                              : run_in_processes(files, *options);
  });
}

void add_up(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "up", "Bring a cell up without a procedure; berth run then runs procedures in it");
  auto options = std::make_shared<CellOptions>();
  add_cell_options(*command, *options);
  command->callback([options, &exit_code] {
    complete(*options);
    const RunFiles files = RunFiles::create(options->request);
    const RunSetup& setup = files.setup;
    print_notes(target_notes(load_target(setup.target, setup.target_length)), setup.target);
    exit_code = run_in_processes(files, *options);
  });
}

}  // namespace berth::commands
