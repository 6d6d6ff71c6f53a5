// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "procedures/language/limit.h"
#include "procedures/language/source.h"
#include "procedures/language/steps.h"
#include "procedures/language/verbs.h"

namespace berth::procedures {

struct Unrolled {
  std::vector<Step> steps;
  std::vector<Limit> limits;  ///< of called procedures
};

/// Reads a list of steps, with repeats, sweeps, calls and calibrations unrolled.
/// @param list "steps" or "teardown"
Unrolled unroll(const Source& source, const std::string& list, Library& library);

/// The blocks: repeat, sweep, call, calibrate. They have no readers of a verb.
const std::vector<VerbInfo>& blocks();

}  // namespace berth::procedures
