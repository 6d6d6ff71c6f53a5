// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "app/terminal/style.h"
#include "procedures/check/check.h"

namespace berth::terminal {

/// What `berth check` prints of one procedure: a line for each step, what was found, a summary.
std::vector<Line> check_list(const procedures::CheckReport& report, std::size_t width);

}  // namespace berth::terminal
