// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/unit.h"

#include <algorithm>

namespace berth::logs {
namespace {

struct Suffix {
  std::string_view end;
  std::string_view unit;
};
/// Longer ones first, where one is the end of another.
constexpr Suffix suffixes[] = {
    {"_m_s2", "m/s^2"}, {"_mm_s2", "mm/s^2"}, {"_rad_s2", "rad/s^2"}, {"_deg_s2", "deg/s^2"},
    {"_mm_s", "mm/s"},  {"_m_s", "m/s"},      {"_rad_s", "rad/s"},    {"_deg_s", "deg/s"},
    {"_m_s3", "m/s^3"}, {"_m", "m"},          {"_mm", "mm"},          {"_um", "um"},
    {"_km", "km"},      {"_mrad", "mrad"},    {"_urad", "urad"},      {"_rad", "rad"},
    {"_deg", "deg"},    {"_ms", "ms"},        {"_us", "us"},          {"_ns", "ns"},
    {"_s", "s"},        {"_hz", "Hz"},        {"_khz", "kHz"},        {"_mhz", "MHz"},
    {"_kg", "kg"},      {"_nm", "nm"},        {"_percent", "%"},      {"_bytes", "B"},
    {"_mb", "MB"},      {"_volt", "V"},       {"_kelvin", "K"},
};

constexpr std::string_view words[] = {
    "m",  "mm", "um", "km",    "rad",   "mrad",  "urad",    "deg",  "s",
    "ms", "us", "ns", "Hz",    "kHz",   "MHz",   "m/s",     "mm/s", "kg",
    "g",  "N",  "Nm", "rad/s", "deg/s", "m/s^2", "rad/s^2", "V",    "A",
    "W",  "K",  "Pa", "%",     "degC",  "lux",   "J",       "dB",
};

struct Spelt {
  std::string_view word;
  std::string_view unit;
};
constexpr Spelt spelt[] = {
    {"metres", "m"},       {"meters", "m"},        {"radians", "rad"},     {"degrees", "deg"},
    {"seconds", "s"},      {"milliseconds", "ms"}, {"microseconds", "us"}, {"nanoseconds", "ns"},
    {"millimetres", "mm"}, {"millimeters", "mm"},
};

std::string known(std::string_view word) {
  if (std::find(std::begin(words), std::end(words), word) != std::end(words)) {
    return std::string(word);
  }
  for (const Spelt& s : spelt) {
    if (s.word == word) return std::string(s.unit);
  }
  return "";
}

/// "utime" as a word of the name: microseconds since the epoch, by LCM's convention.
bool has_utime(std::string_view name) {
  const auto at = name.find("utime");
  if (at == std::string_view::npos || (at > 0 && name[at - 1] != '_')) return false;
  const auto end = at + 5;
  return end == name.size() || name[end] == '_';
}

}  // namespace

std::string unit_of(std::string_view name, std::string_view comment) {
  if (has_utime(name)) return "us";
  for (const Suffix& suffix : suffixes) {
    if (name.size() > suffix.end.size() &&
        name.substr(name.size() - suffix.end.size()) == suffix.end) {
      return std::string(suffix.unit);
    }
  }
  const std::string first = known(comment.substr(0, comment.find_first_of(" ,;:.")));
  if (!first.empty()) return first;
  const auto open = comment.find('[');
  const auto close = comment.find(']', open == std::string_view::npos ? 0 : open);
  if (open == std::string_view::npos || close == std::string_view::npos) return "";
  return known(comment.substr(open + 1, close - open - 1));
}

}  // namespace berth::logs
