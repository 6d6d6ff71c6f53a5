// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {

/// A relative motion that was flown before, flown again.
struct Recorded {
  Waypoints places;              ///< T_sensor_model, smoothed
  double ramp = 2;               ///< s: it may begin and end under way
  double speed = 0.05;           ///< m/s on the straight way to where it begins
  double angular_speed = 0.087;  ///< rad/s
};

/// Straight to where the record begins, then along it at its own pace.
Waypoints recorded(const Pose& from, const Recorded& options);

/// Samples as they were measured, noise and all, made smooth: places `spacing` apart, s, each from
/// a straight line fitted to the samples within `spacing` of it. At least two.
Waypoints smoothed(const Waypoints& samples, double spacing);

}  // namespace berth::testbed
