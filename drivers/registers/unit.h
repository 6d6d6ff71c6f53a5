// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/config.h"

namespace berth {

/// A register map's `unit`: the address in Modbus' header. @throws InputError.
inline int read_unit(Config& config) {
  const int unit = config.small_integer("unit", within(0, 255));
  if (unit > 247 && unit != 255) {
    throw config.error("unit", "found " + std::to_string(unit) +
                                   ", expected 1 to 247, or 255 or 0 for a device behind no "
                                   "gateway");
  }
  return unit;
}

}  // namespace berth
