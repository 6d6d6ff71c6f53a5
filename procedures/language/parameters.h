// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace berth::procedures {

/// NAME=VALUE as an operator gives it with --set.
using Overrides = std::map<std::string, std::string>;

/// The text of a procedure as it will run: the values in its block `parameters` replaced by the
/// overrides, and every ${name} by its value. Lines keep their numbers.
///
///     parameters:
///       speed: 20 mm/s              # one per line, on this line
///       start: [100, -100, 5500, 10, 8, -12]
///
/// @throws InputError with file and line for an unknown or unused parameter, and for an override
/// that names none or is of another kind than the value it replaces.
std::string apply_parameters(const std::string& text, const std::string& file,
                             const Overrides& overrides);

}  // namespace berth::procedures
