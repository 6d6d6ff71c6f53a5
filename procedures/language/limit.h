// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/config.h"
#include "procedures/engine/live_quantity.h"
#include "procedures/language/schema.h"

namespace berth::procedures {

/// A live quantity that is watched in the background while the steps run.
struct Limit {
  enum class Then { fail, abort, hold };
  std::string name;
  const LiveQuantity* quantity = nullptr;
  double lower = 0;     ///< SI; -inf: none
  double upper = 0;     ///< +inf: none
  std::string phase;    ///< empty: all of the run before the teardown
  double duration = 0;  ///< s for which it must be broken without a break
  Then then = Then::fail;
  int first_step = 0;  ///< watched from this step
  int last_step = 0;   ///< to this one: the steps of the procedure that contains the limit
  std::string file;
  int line = 0;
};

/// Reads the list `limits` of a procedure:
///
///     limits:
///       - name: never too near
///         watch: surface_range    # a live quantity
///         min: 3 m                # and/or max
///         phase: approach         # optional
///         for: 0.5 s              # optional
///         then: abort             # fail (standard), abort or hold
std::vector<Limit> read_limits(Config& procedure);

/// The keys of a limit.
const std::vector<KeyInfo>& limit_keys();

}  // namespace berth::procedures
