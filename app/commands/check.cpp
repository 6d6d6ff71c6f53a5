// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/commands/cell_options.h"
#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/terminal/check_list.h"
#include "common/core/error.h"
#include "common/core/shared_files.h"
#include "common/core/valid_text.h"
#include "procedures/language/schema.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct CheckOptions {
  std::vector<fs::path> paths;
  SetupChoice choice;
  std::string target_length;
  std::vector<std::string> set;
  bool json = false;
  bool schema = false;
};

/// The files named, and every procedure of the directories named, in order of their names.
std::vector<fs::path> procedures_in(const std::vector<fs::path>& paths) {
  std::vector<fs::path> files;
  for (const fs::path& named : paths) {
    const fs::path path = here_or_shipped(named);
    if (!fs::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    const auto found = procedures::procedures_in(path);
    if (found.empty()) throw InputError(path.string() + ": holds no procedure (*.yaml)");
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

procedures::CheckReport report_on(const fs::path& file, const CheckOptions& options) {
  try {
    const auto procedure = procedures::load_procedure(file, overrides_of(options.set));
    const RunSetup setup = choose_setup(options.choice, &procedure);
    choose_world(options.choice, setup.config, &procedure);
    return procedures::check_procedure(procedure, setup);
  } catch (const InputError& e) {
    return procedures::report_of_error(e.what(), file.string());
  }
}

void print(const procedures::CheckReport& report) {
  constexpr std::size_t width = 100;
  const bool colours = terminal::use_colours(STDOUT_FILENO);
  for (const terminal::Line& line : terminal::check_list(report, width)) {
    std::printf("%s\n", line.rendered(colours).c_str());
  }
}

int check(CheckOptions& options) {
  if (options.schema) {
    std::fputs(procedures::json_schema().c_str(), stdout);
    return exit_code::passed;
  }
  if (options.paths.empty()) throw InputError("which procedures? Give files, or directories");
  if (!options.target_length.empty()) {
    options.choice.target_length = target_length_of(options.target_length);
  }
  const auto files = procedures_in(options.paths);
  if (files.empty()) throw InputError("check: expected a procedure, or a directory of them");
  nlohmann::json reports = nlohmann::json::array();
  std::size_t bad = 0;
  for (const fs::path& file : files) {
    const auto report = report_on(file, options);
    if (!report.good()) ++bad;
    if (options.json) {
      reports.push_back(procedures::json_of(report));
    } else {
      print(report);
      if (files.size() > 1) std::printf("\n");
      std::fflush(stdout);
    }
  }
  if (options.json) {
    std::printf("%s\n", json_text(reports, 2).c_str());
  } else if (files.size() > 1) {
    std::printf("%zu procedures, %zu ready, %zu with errors\n", files.size(), files.size() - bad,
                bad);
  }
  return bad == 0 ? exit_code::passed : exit_code::error;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "check",
      "Prove as much as can be of procedures before anything moves: names, units, reach, "
      "clearance,\n"
      "what the LIDAR sees and the criteria measure. Exit code 2 where there is an error.");
  auto options = std::make_shared<CheckOptions>();
  command->add_option("procedure", options->paths, "Procedures, or directories of them");
  command->add_option("--layout", options->choice.layout,
                      "Layout of config/layouts instead of the procedure's own");
  command->add_option("--target", options->choice.target,
                      "Target instead of the procedure's own: a name of targets/, a folder with a "
                      "target.yaml, or a mesh");
  command->add_option("--target-length", options->target_length,
                      "Scale the target so that its longest side is this long, in metres");
  command->add_option("--set", options->set, "A parameter of the procedure: NAME=VALUE")
      ->type_name("NAME=VALUE");
  command->add_option("--config", options->choice.config,
                      "Configuration directory instead of the one shipped");
  command->add_flag("--json", options->json, "Findings and steps as JSON");
  command->add_flag("--schema", options->schema,
                    "Print the JSON Schema of procedures, for editors, and check nothing");
  command->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace berth::commands
