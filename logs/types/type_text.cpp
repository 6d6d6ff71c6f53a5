// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/type_text.h"

#include <cinttypes>
#include <cstdio>
#include <ctime>

namespace berth::logs {

std::string short_name(const StructType& type) {
  return type.name.rfind("berth.", 0) == 0 ? type.name.substr(6) : type.name;
}

std::string hexadecimal(std::uint64_t fingerprint) {
  char text[24];
  std::snprintf(text, sizeof text, "0x%016" PRIx64, fingerprint);
  return text;
}

std::string text_of_utime(Utime utime) {
  std::time_t whole = utime / second;
  Utime rest = utime % second;
  if (rest < 0) {
    rest += second;
    --whole;
  }
  std::tm parts{};
  if (gmtime_r(&whole, &parts) == nullptr) return std::to_string(utime) + " us";
  char text[80];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
  std::snprintf(text + length, sizeof text - length, ".%06d", static_cast<int>(rest));
  return text;
}

}  // namespace berth::logs
