// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/text.h"

#include <cstdio>

namespace berth {

std::string fixed(double value, int decimals) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

}  // namespace berth
