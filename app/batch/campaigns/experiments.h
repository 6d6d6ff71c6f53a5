// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/runner.h"

namespace berth::campaigns {

/// Single scans of a target in empty space.
std::unique_ptr<Experiment> make_acquisition_experiment(const Campaign& campaign);
/// A procedure in the twin.
std::unique_ptr<Experiment> make_procedure_experiment(const Campaign& campaign);

}  // namespace berth::campaigns
