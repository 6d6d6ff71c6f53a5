// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

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
  /// Where the model's origin is in the file's own coordinates, m: not 0 where the file's origin is
  /// far from the mesh, as in coordinates of a map.
  Vector3d file_origin = Vector3d::Zero();
};

/// How far front and back, top and bottom of the procedural replica differ.
enum class SymmetryBreaker { none, paper, strong };

/// The 1:5 replica of Radarsat-2, 3.00 m long: four antenna panels, bus, two solar arrays on yokes,
/// extendible support structure, launch-adapter ring with three unequal lugs on the front.
/// Dimensions: CSA's page on Radarsat-2 (archived 2006), ring diameter 1194 mm / 5 a choice of
/// ours.
Mesh make_radarsat2(SymmetryBreaker breaker = SymmetryBreaker::paper);

/// The target a user names: "radarsat2" or a mesh file. length > 0 scales it; 0 keeps it as it is
/// (the replica: 3 m). A mesh named by file is used in its own axes, about its own origin; where
/// that is far_from_origin, about the centre of its bounding box.
/// @throws InputError as load_mesh, or for a negative length.
Target load_target(const std::string& name, double length);

/// What a user may regret about a target, a sentence each, with what to do: its length, origin or
/// thickness, faces that look inward, faces that were left out. Empty: nothing.
std::vector<std::string> target_notes(const Target& target);

}  // namespace berth
