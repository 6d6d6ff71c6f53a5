// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/lidar/mirror.h"

#include <cmath>

#include "common/core/positive.h"

namespace berth {

MirrorSettings read_mirror(Config config) {
  MirrorSettings mirror;
  double settle = seconds(mirror.settle);
  config.optional("settle", Dimension::time, settle);
  mirror.settle = utime_from_seconds(settle);
  config.optional("acceleration", Dimension::angular_acceleration, mirror.acceleration);
  config.optional("speed", Dimension::angular_speed, mirror.speed);
  config.finish();
  expect_not_negative(config, "settle", mirror.settle);
  expect_positive(config, "acceleration", mirror.acceleration);
  expect_positive(config, "speed", mirror.speed);
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
