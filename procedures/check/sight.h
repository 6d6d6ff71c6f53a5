// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "procedures/check/finding.h"
#include "procedures/check/rehearsal.h"

namespace berth::procedures {

/// How much of the replica the LIDAR can see from where it stands.
struct Sight {
  double share = 0;     ///< of the surface turned to the sensor that can be measured
  double outside = 0;   ///< of it: beyond the field of view,
  double too_near = 0;  ///<   nearer than the LIDAR's least range or the gate,
  double too_far = 0;   ///<   farther than its greatest range or the gate
  double nearest = 0;   ///< m, of that surface
  double farthest = 0;
};

/// Looks at the target from the sensor's place, ray by ray.
class Lookout {
 public:
  explicit Lookout(const Rig& rig);
  Sight look(const Pose& pose, const estimator::RangeGate& gate) const;

 private:
  const Rig& rig_;
  std::vector<Vector3d> points_;  // of the surface, evenly spread, model frame
};

/// Whether the LIDAR can see the replica wherever it is to be found or tracked.
std::vector<Finding> check_sight(const Procedure& procedure, const Rig& rig,
                                 const Rehearsal& rehearsal);

}  // namespace berth::procedures
