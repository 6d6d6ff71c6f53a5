// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/targets/target.h"

namespace berth::commands {

/// Writes target_notes() to standard error, under the name that the user gave the target.
void print_notes(const std::vector<std::string>& notes, const std::string& named);

}  // namespace berth::commands
