// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/dead_time_told.h"

#include <cmath>
#include <cstdio>

#include "common/core/text.h"

namespace berth {

std::string DeadTimeTold::text(const std::string& because) const {
  return "a dead time of " + fixed(1e-3 * static_cast<double>(us), 1) +
         " ms is reckoned with: " + because;
}

std::optional<DeadTimeTold> DeadTimeTold::parse(const std::string& text) {
  double ms = 0;
  if (std::sscanf(text.c_str(), "a dead time of %lf ms is reckoned with", &ms) != 1) {
    return std::nullopt;
  }
  return DeadTimeTold{std::llround(1e3 * ms)};
}

}  // namespace berth
