// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/config.h"

namespace berth {

/// Complains of a value that makes no sense at zero or below, NaN among them. @throws InputError.
inline void expect_positive(const Config& config, const std::string& key, double value) {
  if (!(value > 0)) throw config.error(key, "must be greater than zero");
}

/// A quantity that must be there, and be greater than zero. @throws InputError.
inline double positive(Config& config, const std::string& key, Dimension dimension) {
  const double value = config.quantity(key, dimension);
  expect_positive(config, key, value);
  return value;
}

/// Complains of a value below zero, NaN among them. @throws InputError.
inline void expect_not_negative(const Config& config, const std::string& key, double value) {
  if (!(value >= 0)) throw config.error(key, "must not be negative");
}

/// A quantity that must be there, and not be below zero. @throws InputError.
inline double not_negative(Config& config, const std::string& key, Dimension dimension) {
  const double value = config.quantity(key, dimension);
  expect_not_negative(config, key, value);
  return value;
}

}  // namespace berth
