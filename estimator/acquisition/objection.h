// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/acquisition/beam_race.h"

namespace berth::estimator {

struct ViewAcquisitionOptions;

/// Why the pose cannot be right; empty when nothing speaks against it.
std::string objection(const BeamRace& race, const Contender& best,
                      const LikelihoodOptions& likelihood, const ViewAcquisitionOptions& options);

/// Whether nearly all beams that should meet the target do, but for what hides it.
bool crisp(const Contender& contender, double noise_scale);
/// Whether it explains most of what is inside the gate.
bool explains_most(const BeamRace& race, const Contender& contender);

}  // namespace berth::estimator
