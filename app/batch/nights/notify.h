// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "app/batch/nights/verdict.h"

namespace berth::nights {

/// Runs the plan's shell command with the summary on its standard input and, in its environment,
/// BERTH_NIGHT, BERTH_NIGHT_VERDICT, BERTH_NIGHT_EXIT_CODE, BERTH_NIGHT_DIRECTORY,
/// BERTH_NIGHT_INDEX, BERTH_NIGHT_VERSION and BERTH_NIGHT_BUILD (the program). Waits for its end.
/// @return what went wrong, or nothing
std::string notify(const std::string& command, const NightReport& report,
                   const std::filesystem::path& out, const std::filesystem::path& program);

}  // namespace berth::nights
