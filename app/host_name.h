// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <string>

namespace berth {

/// This machine's own name.
inline std::string host_name() {
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  return name;
}

}  // namespace berth
