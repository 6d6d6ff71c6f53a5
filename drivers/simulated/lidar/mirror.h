// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/bus/loop.h"
#include "common/core/config.h"

namespace berth {

/// How the scanner goes from one place to another: section `mirror` of
/// config/simulation_lidar.yaml.
struct MirrorSettings {
  Utime settle = 500;
  double acceleration = 20000;  ///< rad/s^2, of the beam
  double speed = 50;            ///< rad/s, of the beam
};

/// @throws InputError.
MirrorSettings read_mirror(Config config);

/// From one beam to another so far away (rad), when both are fired at rest: bang-bang acceleration
/// up to the greatest speed, then settling. 0 for no angle.
Utime slew_time(const MirrorSettings& mirror, double angle);

}  // namespace berth
