// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/target.h"

namespace berth::commands {

/// Says on standard error what the user may regret about the target they named.
void print_notes(const Target& target, const std::string& named);

}  // namespace berth::commands
