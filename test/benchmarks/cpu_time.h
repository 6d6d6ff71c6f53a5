// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ctime>

namespace berth::benchmark {

/// CPU time of this thread in milliseconds: what else the machine does counts little.
inline double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace berth::benchmark
