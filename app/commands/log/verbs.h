// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/runs/run_list.h"
#include "logs/types/type_catalogue.h"

namespace CLI {
class App;
}

/// One function per verb of `berth log`, and what they share.
namespace berth::commands::log {

void add_info(CLI::App& log, int& exit_code);
void add_check(CLI::App& log, int& exit_code);
void add_repair(CLI::App& log, int& exit_code);
void add_cut(CLI::App& log, int& exit_code);
void add_filter(CLI::App& log, int& exit_code);
void add_export(CLI::App& log, int& exit_code);
void add_diff(CLI::App& log, int& exit_code);
void add_estimates(CLI::App& log, int& exit_code);

using Paths = std::vector<std::filesystem::path>;

/// The argument "log": what log_of_run() takes.
std::shared_ptr<std::string> add_log_argument(CLI::App& command, const std::string& name = "log");
/// The option --types.
std::shared_ptr<Paths> add_types_option(CLI::App& command);

/// The types of logs: those given, those of the run directories that the logs are in, and Berth's
/// own; of one fingerprint the first. @throws InputError as TypeCatalogue::add().
logs::TypeCatalogue types_of(const Paths& logs, const Paths& given);

}  // namespace berth::commands::log
