// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/mesh.h"

namespace berth {

/// How far front and back, top and bottom of the procedural replica differ.
enum class SymmetryBreaker { none, paper, strong };

/// The 1:5 replica of Radarsat-2, 3.00 m long: four antenna panels, bus, two solar arrays on yokes,
/// extendible support structure, launch-adapter ring with three unequal lugs on the front.
/// targets/radarsat2/target.ply is that of the paper.
Mesh make_radarsat2(SymmetryBreaker breaker = SymmetryBreaker::paper);

/// The procedural replica (see make_radarsat2) together with where its docking interface is. The
/// origin is the centroid of the surface, the antenna stretches along x, the bus along y.
struct Radarsat2 {
  Mesh mesh;
  Pose docking;  ///< T_model_docking, at the centre of the ring's rim, z out of it
};

Radarsat2 build_radarsat2(SymmetryBreaker breaker);

}  // namespace berth
