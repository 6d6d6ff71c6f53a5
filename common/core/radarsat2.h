// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/target.h"

namespace berth {

/// The procedural replica (see make_radarsat2) together with where its docking interface is. The
/// origin is the centroid of the surface, the antenna stretches along x, the bus along y.
struct Radarsat2 {
  Mesh mesh;
  Pose docking;  ///< T_model_docking, at the centre of the ring's rim, z out of it
};

Radarsat2 build_radarsat2(SymmetryBreaker breaker);

}  // namespace berth
