// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <exception>
#include <string>

#include "common/core/valid_text.h"

namespace berth {

/// Runs work that must not change the outcome of a run, a night or a campaign: clearing up, pages,
/// lists. An error in it is a warning on standard error. @return whether it was done.
template <class Work>
bool attempt(Work work) {
  try {
    work();
    return true;
  } catch (const std::exception& e) {
    print_text(std::string("berth: warning: ") + e.what() + "\n", stderr);
    return false;
  }
}

}  // namespace berth
