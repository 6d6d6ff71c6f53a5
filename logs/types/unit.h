// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace berth::logs {

/// The unit of a field: from the end of its name (range_m, speed_m_s, rate_hz, utime_sent), else
/// from its comment when that begins with a unit or has one in square brackets. Empty: none told.
std::string unit_of(std::string_view name, std::string_view comment);

}  // namespace berth::logs
