// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/beam_model.h"
#include "estimator/acquire/acquisition.h"
#include "estimator/plan/scan_planner.h"

namespace berth::estimator {

/// The scan windows that tell hypotheses apart: where expected_evidence of one against another, by
/// beams of that noise, is greatest. At most four, which share the beams; empty when no beam in the
/// field of view tells them apart. surface_sigma: of the true surface's distance from the mesh, m.
std::vector<Window> discriminating_windows(const TargetModel& model,
                                           const std::vector<Hypothesis>& hypotheses,
                                           const FieldOfView& field, int beams,
                                           const BeamModel& noise, double surface_sigma);

}  // namespace berth::estimator
