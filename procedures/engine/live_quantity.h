// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/quantity.h"

namespace berth::procedures {

class LatestMessages;

/// A named thing that can be read at any time while a procedure runs: in conditions, limits
/// and records.
struct LiveQuantity {
  std::string name;
  Dimension dimension;
  std::string unit;  ///< in which it is shown
  double unit_si;    ///< size of that unit
  std::string description;
  double (*value)(
      const LatestMessages& live);      ///< SI, of a state the index of its word; NaN: not known
  std::vector<std::string> words = {};  ///< of a state; empty for a quantity

  bool is_state() const { return !words.empty(); }
  /// "3.201 m", "ok" or "not known".
  std::string text(double si) const;
};

const std::vector<LiveQuantity>& live_quantities();
/// nullptr when there is none of this name.
const LiveQuantity* live_quantity_named(const std::string& name);
/// "found 'x', expected one of: ...", with all names.
std::string unknown_live_quantity(const std::string& name);

}  // namespace berth::procedures
