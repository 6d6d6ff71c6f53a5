// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/bus/loop.h"
#include "common/core/pose.h"

namespace berth {

/// What a beam meets.
struct SceneHit {
  double range = 0;         ///< m along the beam
  double incidence = 0;     ///< rad between beam and surface normal, 0..pi/2
  double reflectivity = 0;  ///< 0..1
  bool target = false;      ///< else arms, mount or room
};

/// The simulated world as the LIDAR sees it.
class Scene {
 public:
  virtual ~Scene() = default;
  /// The first thing met at time t by a beam from the sensor's origin. Direction: unit, sensor
  /// frame.
  /// @return false when nothing is met nearer than max_range (m).
  virtual bool cast(Utime t, const Vector3d& direction, double max_range, SceneHit& hit) = 0;
};

}  // namespace berth
