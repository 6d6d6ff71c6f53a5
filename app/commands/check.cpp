// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/error.h"
#include "procedures/language/procedure.h"

namespace berth::commands {

void add_check(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "check", "Check procedures without running them: syntax, names, units, parameters");
  auto files = std::make_shared<std::vector<std::filesystem::path>>();
  command->add_option("procedure", *files, "Procedures")->required();
  command->callback([files, &exit_code] {
    for (const auto& file : *files) {
      try {
        const auto procedure = procedures::load_procedure(file);
        std::printf("ok   %s: %zu steps, %zu criteria\n", file.c_str(), procedure.steps.size(),
                    procedure.criteria.size());
      } catch (const InputError& e) {
        std::printf("BAD  %s\n", e.what());
        exit_code = exit_code::error;
      }
    }
  });
}

}  // namespace berth::commands
