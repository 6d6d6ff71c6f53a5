// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/runs/choose_setup.h"
#include "evaluation/report/reported_run.h"

/// Options that several commands read alike.
namespace berth::commands {

/// NAME=VALUE, any number of them, as given to the option. @throws InputError.
std::map<std::string, std::string> assignments_of(const std::string& option,
                                                  const std::vector<std::string>& assignments);

/// --set NAME=VALUE, any number of them. @throws InputError.
procedures::Overrides overrides_of(const std::vector<std::string>& assignments);

/// --lidar PATH as keys of devices.yaml: a recording takes the LIDAR's place. @throws InputError.
std::map<std::string, std::string> recorded_lidar(const std::string& path);

/// --target-length, in m unless it names its unit. @throws InputError.
double target_length_of(const std::string& text);

/// The runs that a user names (see find_run), judged from their logs: of a log all that it holds.
/// What cannot be read is told on standard error and costs no other run.
/// @param worst exit code, made worse by each run and by what cannot be read
std::vector<report::ReportedRun> read_runs(const std::vector<std::string>& names, int& worst);

}  // namespace berth::commands
