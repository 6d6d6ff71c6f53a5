// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth {

/// One thing that must be right on this machine, and the command that mends it.
struct Finding {
  enum class State { good, warning, bad };
  State state = State::good;
  std::string subject;
  std::string found;
  std::string remedy;  ///< a command or a sentence; empty when good
};

/// Multicast route, socket buffers, loopback self test on the URL, recorder, disk, clock, other
/// runs.
std::vector<Finding> examine(const std::string& url);

/// Prints the findings. @return an exit code: 0, or 2 when one is bad.
int doctor(const std::string& url);

}  // namespace berth
