// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/run_options.h"

#include <cstdio>
#include <filesystem>

#include "app/exit_code.h"
#include "app/runs/run_list.h"
#include "common/core/error.h"
#include "common/core/quantity.h"

namespace berth::commands {

std::map<std::string, std::string> assignments_of(const std::string& option,
                                                  const std::vector<std::string>& assignments) {
  std::map<std::string, std::string> values;
  for (const auto& assignment : assignments) {
    const auto equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(option + " " + assignment + ": expected NAME=VALUE");
    }
    values[assignment.substr(0, equals)] = assignment.substr(equals + 1);
  }
  return values;
}

procedures::Overrides overrides_of(const std::vector<std::string>& assignments) {
  return assignments_of("--set", assignments);
}

std::map<std::string, std::string> recorded_lidar(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path found = fs::canonical(path, error);
  if (error) throw InputError("--lidar " + path + ": no such file or directory");
  const bool log = found.extension() == ".lcm" || fs::exists(found / "run.lcm", error);
  return {{"devices.yaml:lidar.adapter", log ? "log" : "files"},
          {"devices.yaml:lidar.recording", found.string()}};
}

double target_length_of(const std::string& text) {
  const bool has_unit = text.find('m') != std::string::npos;
  double length = 0;
  try {
    length = parse_quantity(text + (has_unit ? "" : " m"), Dimension::length);
  } catch (const InputError& e) {
    throw InputError(std::string("--target-length: ") + e.what());
  }
  if (length <= 0) throw InputError("--target-length: must be positive");
  return length;
}

std::vector<report::ReportedRun> read_runs(const std::vector<std::string>& names, int& worst) {
  std::vector<report::ReportedRun> runs;
  for (const std::string& name : names) {
    try {
      const std::filesystem::path found = find_run(name);
      const bool is_directory = std::filesystem::is_directory(found);
      for (report::ReportedRun& run :
           report::read_reported_runs(log_of_run(name), is_directory ? found : "")) {
        worst =
            exit_code::worst(worst, evaluation::exit_code_of_outcome(run.run.comparison.outcome));
        runs.push_back(std::move(run));
      }
    } catch (const std::exception& e) {
      std::fprintf(stderr, "berth: %s\n", e.what());
      worst = exit_code::worst(worst, exit_code::error);
    }
  }
  return runs;
}

}  // namespace berth::commands
