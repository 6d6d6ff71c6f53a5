// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>

#include "app/commands/commands.h"
#include "app/commands/log/verbs.h"
#include "app/runs/run_files.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"

namespace berth::commands {
namespace log {

namespace fs = std::filesystem;

std::shared_ptr<std::string> add_log_argument(CLI::App& command, const std::string& name) {
  auto path = std::make_shared<std::string>();
  command.add_option(name, *path, "Log, run directory, name of a run in runs/, or 'last'")
      ->required();
  return path;
}

std::shared_ptr<Paths> add_types_option(CLI::App& command) {
  auto types = std::make_shared<Paths>();
  command.add_option("--types", *types,
                     "More message types: a .lcm file or a directory of them; once for each");
  return types;
}

logs::TypeCatalogue types_of(const Paths& logs, const Paths& given) {
  logs::TypeCatalogue types;
  for (const fs::path& path : given) types.add(path);
  for (const fs::path& log : logs) {
    const fs::path run = log.parent_path();
    if (!fs::exists(run / "run.yaml") || !fs::is_directory(run / "types")) continue;
    try {
      types.add(run / "types");
    } catch (const InputError& e) {
      print_text(std::string("berth: ") + e.what() + "; Berth's own types are used\n", stderr);
    }
  }
  types.add(shared_files() / "lcmtypes");
  return types;
}

}  // namespace log

void add_log(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "log", "Look into logs, check and mend them, cut, export and compare them");
  command->require_subcommand(1);
  log::add_info(*command, exit_code);
  log::add_check(*command, exit_code);
  log::add_repair(*command, exit_code);
  log::add_cut(*command, exit_code);
  log::add_filter(*command, exit_code);
  log::add_export(*command, exit_code);
  log::add_diff(*command, exit_code);
  log::add_estimates(*command, exit_code);
}

}  // namespace berth::commands
