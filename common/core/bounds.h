// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>

#include "common/core/quantity.h"

namespace berth {

/// The values that a key may have, in SI units; by default any.
///
///     above(0).below(0.9)
struct ValueBounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool has_low = true;   ///< low is itself allowed
  bool has_high = true;  ///< high is itself allowed

  constexpr bool contain(double value) const {
    return (has_low ? value >= low : value > low) && (has_high ? value <= high : value < high);
  }
  constexpr ValueBounds at_most(double value) const { return {low, value, has_low, true}; }
  constexpr ValueBounds below(double value) const { return {low, value, has_low, false}; }
};

constexpr ValueBounds at_least(double low) { return ValueBounds{.low = low}; }
constexpr ValueBounds above(double low) { return ValueBounds{.low = low, .has_low = false}; }
constexpr ValueBounds within(double low, double high) {
  return ValueBounds{.low = low, .high = high};
}

/// "above 0", "at least 1 mm", "from 0 to 1", "above 0 and below 0.9"; empty for any value.
std::string text_of(const ValueBounds& bounds, Dimension dimension);

}  // namespace berth
