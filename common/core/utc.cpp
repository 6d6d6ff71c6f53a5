// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/utc.h"

#include <cmath>
#include <cstdio>

namespace berth {
namespace {

std::string formatted(const std::tm& utc) {
  char text[80];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &utc)};
}

}  // namespace

std::string utc_text(std::time_t time) {
  std::tm utc{};
  gmtime_r(&time, &utc);
  std::string text = formatted(utc);
  text[text.find(' ')] = 'T';
  return text + "Z";
}

std::string utc_stamp(const std::string& text) {
  std::string stamp = text;
  std::erase_if(stamp, [](char c) { return c == '-' || c == ':'; });
  return stamp;
}

std::string utc_for_people(std::int64_t utime, bool with_microseconds) {
  constexpr std::int64_t us = 1000000;
  std::time_t whole = utime / us;
  std::int64_t rest = utime % us;
  if (rest < 0) {
    rest += us;
    --whole;
  }
  std::tm utc{};
  if (gmtime_r(&whole, &utc) == nullptr) return std::to_string(utime) + " us";
  const std::string text = formatted(utc);
  if (!with_microseconds) return text;
  char fraction[8];
  std::snprintf(fraction, sizeof fraction, ".%06d", static_cast<int>(rest));
  return text + fraction;
}

std::string clock_text(double s) {
  const auto total = std::lround(s);
  char text[64];
  if (total < 3600) {
    std::snprintf(text, sizeof text, "%ld:%02ld", total / 60, total % 60);
  } else {
    std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", total / 3600, total / 60 % 60, total % 60);
  }
  return text;
}

}  // namespace berth
