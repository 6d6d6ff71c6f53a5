// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "common/bus/loop.h"
#include "logs/types/lcm_type.h"

namespace berth::logs {

/// "event_t" for ours, "other.lab.survey_t" for others.
std::string short_name(const StructType& type);

/// "0xc4a27e6fb13d03d5".
std::string hexadecimal(std::uint64_t fingerprint);

/// "2026-11-21 13:30:54.123456", UTC.
std::string text_of_utime(Utime utime);

}  // namespace berth::logs
