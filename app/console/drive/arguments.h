// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "app/console/server/command.h"

namespace berth::console {

/// What a page's command says. All throw InputError naming command, argument, what was found and
/// what was expected.

/// Empty when it is not there.
std::string text_in(const Command& command, const std::string& key);
/// Finite.
double number_in(const Command& command, const std::string& key);
/// `parameters`: name and value; numbers are written as text.
std::map<std::string, std::string> parameters_in(const Command& command);
/// sun and albedo (0..1), azimuth and elevation (rad), those that are there, as a lights step has
/// them: "sun: 80 %, azimuth: 30 deg".
std::string lamps_text(const Command& command);

}  // namespace berth::console
