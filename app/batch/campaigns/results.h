// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/batch/campaigns/trial.h"

namespace berth::campaigns {

/// One JSON object on one line, without its end. The same result gives the same bytes.
///
///     {"trial":7,"point":1,"seed":123,"parameters":{"returns":"100"},"attitude_wxyz":[1,0,0,0],
///      "outcome":"PASS","failure":"","measurements":{"position_error":2.5},"error":""}
std::string line_of(const TrialResult& result);

/// @param where "file:line", for messages. @throws InputError when it is no such line.
TrialResult result_of_line(const std::string& line, const std::string& where);

/// The results in a file of lines. @throws InputError.
std::vector<TrialResult> read_results(const std::filesystem::path& file);

/// The same from a file that may end in the middle of a line: its whole lines. Empty when there is
/// no file.
std::vector<TrialResult> read_whole_lines(const std::filesystem::path& file);

}  // namespace berth::campaigns
