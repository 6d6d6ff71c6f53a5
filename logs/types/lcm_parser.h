// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "logs/types/lcm_type.h"

namespace berth::logs {

/// The unit of a field: from the end of its name (range_m, speed_m_s, rate_hz, utime_sent), else
/// from its comment when that begins with a unit or has one in square brackets. Empty: none given.
std::string unit_of(std::string_view name, std::string_view comment);

/// The structs of a .lcm file, as lcm-gen 1.3.1 reads it: package, structs, members and arrays of
/// any number of dimensions, constants, comments. Types of members that are structs themselves are
/// not yet known (structure is null). Enumerations, which lcm-gen makes no C++ of, are refused.
/// file: for messages.
/// @throws InputError naming file, line, what was found and what was expected.
std::vector<StructType> parse_lcm(std::string_view text, const std::string& file);

}  // namespace berth::logs
