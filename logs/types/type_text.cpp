// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/type_text.h"

#include <cinttypes>
#include <cstdio>
#include <ctime>

#include "common/core/utc.h"

namespace berth::logs {

std::string short_name(const StructType& type) {
  return type.name.rfind("berth.", 0) == 0 ? type.name.substr(6) : type.name;
}

std::string hexadecimal(std::uint64_t fingerprint) {
  char text[24];
  std::snprintf(text, sizeof text, "0x%016" PRIx64, fingerprint);
  return text;
}

std::string text_of_utime(Utime utime) { return utc_for_people(utime, true); }

}  // namespace berth::logs
