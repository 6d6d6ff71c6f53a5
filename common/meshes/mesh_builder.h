// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/core/mesh.h"
#include "common/core/pose.h"

namespace berth {

/// Cuts a polygon, convex or not, into triangles of the polygon's winding by clipping ears
/// (Meisters, "Polygons have ears", 1975), seen along its mean normal (Newell). A convex polygon is
/// cut into a fan from its first corner, one with a single concave corner into a fan from that
/// corner. Holes may be joined to the outline by an edge that is passed twice. Time grows with the
/// square of the corners where it is concave.
/// @param triangles indices of corners are added; none for a polygon without area.
/// @return false when it crosses itself.
bool triangulate(std::span<const Vector3d> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Makes a mesh from the vertices and faces of a file: vertices of one place become one, polygons
/// triangles, faces without area are counted.
class MeshBuilder {
 public:
  /// From now on vertices stay as they are numbered: a mesh that was saved comes back to the bit.
  void keep_numbering() { keeps_numbering_ = true; }
  /// @return what is wrong with it; empty: nothing.
  std::string add_vertex(const Vector3d& vertex);
  std::size_t vertex_count() const { return file_vertices_.size(); }
  /// corners: numbers of vertices that were added. @return the defect; empty: none.
  std::string add_face(std::span<const std::uint32_t> corners);
  /// Names of the groups that the next faces belong to.
  void set_groups(const std::vector<std::string>& names);
  /// @throws InputError when there is no triangle.
  Mesh take(const std::string& file);

 private:
  struct PlaceHash {
    std::size_t operator()(const std::array<double, 3>& place) const;
  };

  std::uint32_t welded(std::uint32_t file_vertex);
  bool add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  bool keeps_numbering_ = false;
  std::vector<Vector3d> file_vertices_;
  std::vector<std::uint32_t> welded_;  ///< index in the mesh of each of the file's, or none yet
  std::unordered_map<std::array<double, 3>, std::uint32_t, PlaceHash> index_;
  std::map<std::string, std::size_t> group_index_;
  std::vector<std::size_t> groups_;  ///< that the next faces belong to
  std::vector<Vector3d> polygon_;
  std::vector<std::array<std::uint32_t, 3>> pieces_;
  Mesh mesh_;
};

}  // namespace berth
