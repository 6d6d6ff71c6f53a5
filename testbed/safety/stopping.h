// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// Where both arms would stand if they were told to now: they go on at the speed that took them
/// from `before` to `now` (dt, s) for a reaction time (s), and brake with each joint's
/// acceleration.
ArmPair standing_place(const Cell& cell, const ArmPair& before, const ArmPair& now, double dt,
                       double reaction);

}  // namespace berth::testbed
