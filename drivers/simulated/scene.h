// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/bus/loop.h"
#include "common/core/pose.h"

namespace berth {

/// What a beam meets.
struct SceneHit {
  double range = 0;                    ///< m along the beam
  double incidence = 0;                ///< rad between beam and surface normal, 0..pi/2
  double reflectivity = 0;             ///< 0..1
  double specular = 0;                 ///< share of sunlight that is reflected as by a mirror, 0..1
  Vector3d normal = Vector3d::Zero();  ///< unit, turned against the beam, sensor frame
  bool target = false;                 ///< else arms, mount or room
};

/// The sun lamp as the sensor has it at one time.
struct Sunlight {
  double level = 0;                       ///< 0 off .. 1 full
  Vector3d towards = -Vector3d::UnitZ();  ///< unit, to the lamp, sensor frame
  bool in_view = false;                   ///< nothing stands between aperture and lamp
};

/// The simulated world as the LIDAR sees it.
class Scene {
 public:
  virtual ~Scene() = default;
  /// The first thing met at time t by a beam from the sensor's origin. Direction: unit, sensor
  /// frame.
  /// @return false when nothing is met nearer than max_range (m).
  virtual bool cast(Utime t, const Vector3d& direction, double max_range, SceneHit& hit) = 0;
  virtual Sunlight sunlight(Utime) { return {}; }
};

}  // namespace berth
