// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/config.h"

namespace berth::testbed {

/// A quantity that makes no sense at zero or below. @throws InputError.
inline double positive(Config& config, const std::string& key, Dimension dimension) {
  const double value = config.quantity(key, dimension);
  if (!(value > 0)) throw config.error(key, "must be positive");
  return value;
}

}  // namespace berth::testbed
