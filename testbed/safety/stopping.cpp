// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/stopping.h"

#include <cmath>

namespace berth::testbed {

ArmPair standing_place(const Cell& cell, const ArmPair& before, const ArmPair& now, double dt,
                       double reaction) {
  ArmPair place = now;
  for (const ArmRole role : both_arms) {
    const auto& limits = cell.arm(role).kinematics->limits();
    for (std::size_t i = 0; i < 6; ++i) {
      const double speed = (now.of(role)[i] - before.of(role)[i]) / dt;
      place.of(role)[i] +=
          speed * reaction + speed * std::abs(speed) / (2 * limits[i].acceleration);
    }
  }
  return place;
}

}  // namespace berth::testbed
