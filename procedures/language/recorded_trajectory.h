// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/config.h"
#include "testbed/trajectories/trajectory.h"

namespace berth::procedures {

/// Relative poses of an earlier run, with their times in s from the first one: where the replica
/// really was (GROUND_TRUTH), or where it was told to be (TESTBED_STATE).
/// @param run a run directory, or its log
/// @param phase of that run; empty: the whole of it
/// @throws InputError, also when the record has holes.
testbed::Waypoints poses_of_run(const std::filesystem::path& run, const std::string& phase,
                                bool commanded);

}  // namespace berth::procedures
