// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "common/bus/process_loop.h"

namespace berth {

/// Runs the loop until done(), looked at every millisecond. @return whether it was in time; a hang
/// must not hang the test.
inline bool run_until(ProcessLoop& loop, const std::function<bool()>& done,
                      Utime limit = 30 * second) {
  bool in_time = true;
  const auto beat = loop.every(millisecond, [&] {
    if (done()) loop.stop();
  });
  const auto late = loop.after(limit, [&] {
    in_time = false;
    loop.stop();
  });
  loop.run();
  loop.cancel(beat);
  loop.cancel(late);
  return in_time;
}

}  // namespace berth
