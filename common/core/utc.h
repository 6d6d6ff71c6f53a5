// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <ctime>
#include <string>

namespace berth {

/// A time of the wall clock as ISO 8601 text, in UTC: "2026-11-21T22:30:00Z".
std::string utc_text(std::time_t time);
/// Now, for the names of files and directories: "20261121T223000Z". @param text as utc_text() has
/// it
std::string utc_stamp(const std::string& text = utc_text(std::time(nullptr)));
/// For a person, in UTC: "2026-11-21 22:30:00", with microseconds "2026-11-21 22:30:00.123456".
/// @param utime us since the epoch; a year that no calendar has comes as a number
std::string utc_for_people(std::int64_t utime, bool with_microseconds);

/// A duration: "4:07" or "1:04:07".
std::string clock_text(double s);

}  // namespace berth
