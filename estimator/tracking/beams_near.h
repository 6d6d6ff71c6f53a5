// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/beam_selection.h"

namespace berth::estimator {

/// Those of the beams that may come nearer than this (m) to the target as it moves: all of them,
/// and some from up to the diagonal of a voxel farther off. Cheaper than to cast them.
BeamPicks beams_near(const TargetModel& model, std::span<const Beam> beams, const BeamPicks& picks,
                     const BeamLinearisation& at, double distance);

}  // namespace berth::estimator
