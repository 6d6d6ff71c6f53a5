// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/lidar/mirror.h"

#include <cmath>

namespace berth {

MirrorSettings read_mirror(Config config) {
  MirrorSettings mirror;
  config.optional_microseconds("settle", mirror.settle, at_least(0));
  config.optional("acceleration", Dimension::angular_acceleration, mirror.acceleration, above(0));
  config.optional("speed", Dimension::angular_speed, mirror.speed, above(0));
  config.finish();
  return mirror;
}

Utime slew_time(const MirrorSettings& mirror, double angle) {
  if (!(angle > 0)) return 0;
  const double ramp = mirror.speed * mirror.speed / mirror.acceleration;  // up and down again
  const double time = angle < ramp ? 2 * std::sqrt(angle / mirror.acceleration)
                                   : angle / mirror.speed + mirror.speed / mirror.acceleration;
  return utime_from_seconds(time) + mirror.settle;
}

}  // namespace berth
