// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/runs/choose_setup.h"
#include "app/runs/run_files.h"

namespace CLI {
class App;
}

namespace berth::commands {

/// NAME=VALUE, any number of them, as given to the option. @throws InputError.
std::map<std::string, std::string> assignments_of(const std::string& option,
                                                  const std::vector<std::string>& assignments);

/// --set NAME=VALUE, any number of them. @throws InputError.
procedures::Overrides overrides_of(const std::vector<std::string>& assignments);

/// --target-length, in m unless it names its unit. @throws InputError.
double target_length_of(const std::string& text);

/// Writes target_notes() to standard error, under the name that the user gave the target.
void print_notes(const std::vector<std::string>& notes, const std::string& named);

/// Options of commands that run something in a cell.
struct CellOptions {
  RunRequest request;
  std::vector<std::string> set;
  std::string target_length;
  std::string lidar;
  std::string estimator;
  bool twin = false;
  bool hardware = false;
  bool detach = false;
  bool no_check = false;
  bool no_console = false;
  std::vector<std::string> answers;  ///< to prompts, in the twin
};

/// Options of the cell and of how it is brought up.
void add_cell_options(CLI::App& command, CellOptions& options);
/// --twin and --set.
void add_twin_options(CLI::App& command, CellOptions& options);

/// What follows from the options: completes the request. @throws InputError.
void complete(CellOptions& options);

/// Runs to the verdict in this process, on a simulated clock. @return the run's exit code.
int run_in_twin(const RunFiles& files, const std::map<std::string, std::string>& answers = {});
/// The same with processes, shown in this terminal.
int run_in_processes(const RunFiles& files, const CellOptions& options);

}  // namespace berth::commands
