// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "procedures/engine/live_quantity.h"

namespace berth::procedures {

/// A condition on live quantities:
///
///     estimated_range < 4 m
///     estimate is ok and position_error < 20 mm for 2 s
///     testbed is idle or clearance > 0.5 m
///
/// Relations: < <= > >= for quantities, "is" and "is not" for states; joined by "and" or by "or".
struct Condition {
  enum class Relation { below, at_most, above, at_least, is, is_not };
  struct Clause {
    const LiveQuantity* quantity = nullptr;
    Relation relation = Relation::below;
    double value = 0;  ///< SI; of a state the index of the word
  };
  std::string text;  ///< as written
  std::vector<Clause> clauses;
  bool any = false;     ///< joined by "or": one clause suffices
  double duration = 0;  ///< s for which it must hold without a break

  /// Whether it holds now. With an unknown quantity it does not. found: the present values as text:
  /// "estimated_range 4.52 m".
  bool met(const RunMessages& live, std::string& found) const;
};

/// @throws InputError "found '...', expected ...", without file and line.
Condition parse_condition(const std::string& text);

}  // namespace berth::procedures
