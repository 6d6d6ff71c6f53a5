// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "procedures/check/finding.h"
#include "procedures/check/rehearsal.h"

namespace berth::procedures {

/// Whether each criterion can be judged on what the run will record, by judging a record of the
/// rehearsal: what cannot be measured there, or fails although all went as planned, is an error.
std::vector<Finding> check_criteria(const Procedure& procedure, const Rig& rig,
                                    const Rehearsal& rehearsal);

}  // namespace berth::procedures
