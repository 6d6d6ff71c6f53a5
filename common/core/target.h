// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/mesh.h"

namespace berth {

/// The satellite that the replica arm holds, in the model frame: as in the paper (section 4.3) the
/// major axis along x and the minor along y; the side with the docking interface looks along -z, so
/// that at the identity pose it faces the sensor.
struct Target {
  std::string name;   ///< "radarsat2", or the mesh file's stem
  Mesh mesh;          ///< metres, as held by the arm
  std::string hash;   ///< content_hash(mesh)
  double length = 0;  ///< largest side of the bounding box, m
  bool has_docking_interface = false;
  Pose docking;  ///< T_model_docking; z out of the interface, towards the chaser
};

/// How far front and back, top and bottom of the procedural replica differ.
enum class SymmetryBreaker { none, paper, strong };

/// The 1:5 replica of Radarsat-2, 3.00 m long: four antenna panels, bus, two solar arrays on yokes,
/// extendible support structure, launch-adapter ring with three unequal lugs on the front.
/// Dimensions: CSA's page on Radarsat-2 (archived 2006), ring diameter 1194 mm / 5 a choice of
/// ours.
Mesh make_radarsat2(SymmetryBreaker breaker = SymmetryBreaker::paper);

/// The target a user names: "radarsat2" or a mesh file. length > 0 scales it; 0 keeps it as it is
/// (the replica: 3 m). A mesh named by file is used in its own axes, about its own origin.
/// @throws InputError as load_mesh, or for a negative length.
Target load_target(const std::string& name, double length);

}  // namespace berth
