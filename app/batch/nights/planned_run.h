// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/nights/plan.h"

namespace berth::nights {

/// Which build a run is of.
enum class Build { tonight, baseline };
const char* name_of(Build build);

/// One run of a night, before it happened.
struct PlannedRun {
  const Case* of = nullptr;
  Build build = Build::tonight;
  std::uint64_t seed = 0;
  bool fresh = false;

  /// Once in a night, good as a file name: "approach-seed3", "approach-seed3-baseline".
  std::string name() const;
};

/// Everything a night runs, in turns: the first seed of all cases, then the second, so that a night
/// that is cut short has some of everything. Fresh seeds follow from the plan's name and the
/// night's number. The baseline runs what is paired: fixed seeds in the twin.
std::vector<PlannedRun> runs_of_night(const Plan& plan, std::int64_t night_number);

}  // namespace berth::nights
