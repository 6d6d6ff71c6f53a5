// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/beam_model.h"
#include "estimator/acquire/acquisition.h"
#include "estimator/plan/scan_planner.h"

namespace berth::estimator {

/// The scan windows that discriminate best between hypotheses: where the expected evidence between
/// pairs, weighted by their probabilities, is largest. At most four, which share the beams; empty
/// when no beam in the field of view discriminates. surface_sigma: of the true surface's distance
/// from the mesh, m.
std::vector<Window> discriminating_windows(const TargetModel& model,
                                           const std::vector<Hypothesis>& hypotheses,
                                           const FieldOfView& field, int beams,
                                           const BeamModel& noise, double surface_sigma);

}  // namespace berth::estimator
