// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/config.h"

namespace berth {

/// Complains of a key under the name that it had before. @throws InputError.
inline void expect_new_name(const Config& config, const std::string& old, const std::string& now) {
  if (config.has(old)) throw config.error(old, "is called '" + now + "' now: rename it");
}

}  // namespace berth
