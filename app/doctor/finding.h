// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/bus/clock_map.h"

namespace berth {

/// One thing that must be right, and what mends it.
struct Finding {
  enum class State { good, warning, bad };
  State state = State::good;
  std::string subject;
  std::string found;
  std::string remedy;  ///< a command or a sentence; empty when good
};

/// Prints them. @return an exit code: 0, or 2 when one is bad.
int print_findings(const std::vector<Finding>& findings);

/// A device's clock against this machine's, watched for so long.
/// bracket: us within which one reading settles the offset
Finding clock_finding(const std::string& device, const ClockLine& line, int jumps, Utime bracket,
                      Utime span);

}  // namespace berth
