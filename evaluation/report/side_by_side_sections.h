// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/report/sections.h"

namespace berth::report {

// The parts of a report in which several runs are compared side by side. Differences are against
// the first.

/// What each run was and how it ended. Links to the runs' own reports are relative to the page.
Html beside_head(const Views& views, const std::filesystem::path& page);
Html beside_criteria(const Views& views);
/// Errors over time, each phase from its own start.
Html beside_curves(const Views& views);
/// The estimates as x y z w p r, from each run's start.
Html beside_poses(const Views& views);
Html beside_measurements(const Views& views);

}  // namespace berth::report
