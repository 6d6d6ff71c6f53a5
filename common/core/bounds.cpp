// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/bounds.h"

#include <cmath>

#include "common/core/text.h"

namespace berth {

std::string text_of(const ValueBounds& bounds, Dimension dimension) {
  const bool low = std::isfinite(bounds.low);
  const bool high = std::isfinite(bounds.high);
  const auto value = [&](double end) -> std::string {
    if (end == 0) return "0";
    const bool whole = dimension == Dimension::number && end == std::floor(end);
    return whole ? fixed(end, 0) : text_of(end, dimension);  // 1000000000, not 1e+11 %
  };
  if (low && high && bounds.has_low && bounds.has_high) {
    return "from " + value(bounds.low) + " to " + value(bounds.high);
  }
  std::string text;
  if (low) text += (bounds.has_low ? "at least " : "above ") + value(bounds.low);
  if (low && high) text += " and ";
  if (high) text += (bounds.has_high ? "at most " : "below ") + value(bounds.high);
  return text;
}

}  // namespace berth
