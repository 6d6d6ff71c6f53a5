// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/pose.h"

namespace berth {

/// Point of the triangle abc nearest to p (Ericson, Real-Time Collision Detection, 5.1.5: regions
/// of Voronoi).
Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                             const Vector3d& c);

/// Triangles that a file names together: a group, object or material of OBJ, a solid of STL.
struct MeshGroup {
  std::string name;
  std::vector<std::uint32_t> triangles;  ///< indices, ascending
};

/// A triangle soup in metres. May be open, non-manifold and of mixed winding: nothing in Berth
/// relies on outward normals.
struct Mesh {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<MeshGroup> groups;       ///< may overlap, and leave triangles out
  std::size_t faces_without_area = 0;  ///< of the file, left out of the triangles

  void append(const Mesh& other, const Pose& placement = {});
};

struct Box {
  Vector3d low = Vector3d::Zero();
  Vector3d high = Vector3d::Zero();
  Vector3d size() const { return high - low; }
  Vector3d centre() const { return 0.5 * (low + high); }
};

/// A mesh of those triangles alone, in that order, with the vertices that they use; without groups.
Mesh cut_out(const Mesh& mesh, const std::vector<std::uint32_t>& triangles);

Box bounding_box(const Mesh& mesh);
/// Whether the origin is so far outside of the box that 32 bits, in which surfaces are searched,
/// would round places in it by more than a millionth of its largest side: at 16 such sides.
bool far_from_origin(const Box& box);
/// Scaled about the mesh's origin so that the largest side of its bounding box is length (m).
Mesh scaled_to_length(const Mesh& mesh, double length);
/// SHA-256 over vertices and triangles: the content, not the file.
std::string content_hash(const Mesh& mesh);

/// A comment in the header of a PLY: its vertices are not joined by place when it is read.
inline constexpr char vertices_as_numbered[] = "vertices are joined as numbered";

/// Binary little-endian PLY, in doubles; read again it is the same mesh, to the bit. @throws
/// InputError when the file cannot be written.
void save_ply(const Mesh& mesh, const std::filesystem::path& path);

/// Building blocks, centred at the origin.
Mesh make_box(const Vector3d& size);
/// Axis along z. sides >= 3.
Mesh make_cylinder(double radius, double height, int sides, bool capped = true);
/// From a to b.
Mesh make_strut(const Vector3d& a, const Vector3d& b, double diameter, int sides = 6);

}  // namespace berth
