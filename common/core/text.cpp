// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/text.h"

#include <cmath>
#include <cstdio>
#include <string_view>

namespace berth {

std::string fixed(double value, int decimals) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  // no sign for -0.0
  const bool zero = text[0] == '-' &&
                    std::string_view(text).find_first_of("123456789in") == std::string_view::npos;
  return zero ? text + 1 : text;
}

std::string shown(double value) {
  if (std::isnan(value)) return "-";
  const double size = std::abs(value);
  return fixed(value, size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3);
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace berth
