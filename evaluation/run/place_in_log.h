// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "logs/file/timeline.h"

namespace berth::evaluation {

/// The place on a log's timeline that a text means: seconds after the log's first event ("12.5",
/// "12.5 s"), a utime (a number of more than 12 digits), or a phase of the procedure; of a phase,
/// and of a time that was there twice, the end when end is true.
/// @throws InputError naming the phases there are.
Utime place_in_log(const std::filesystem::path& log, const logs::Timeline& timeline,
                   const std::string& text, bool end);

}  // namespace berth::evaluation
