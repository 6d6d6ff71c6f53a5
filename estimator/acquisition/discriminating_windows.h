// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquisition/acquisition.h"
#include "estimator/planning/scan_planner.h"

namespace berth::estimator {

/// The scan windows that tell hypotheses apart: where beams would meet the target at ranges that
/// differ most from one hypothesis to the other, or in one and not in the other. At most four,
/// which share the beams; empty when no beam in the field of view tells them apart.
std::vector<Window> discriminating_windows(const TargetModel& model,
                                           const std::vector<Hypothesis>& hypotheses,
                                           const FieldOfView& field, int beams);

}  // namespace berth::estimator
