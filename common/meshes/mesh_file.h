// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/core/mesh.h"

namespace berth {

/// Reads PLY, STL or OBJ, known by the file's extension, whole: every face that the file declares
/// becomes triangles (polygons are cut up, strips followed), or the file is refused. Vertices in 64
/// bits as they stand in the file, those of one place made one, in the order in which triangles use
/// them. Faces without area are left out and counted.
/// @throws InputError naming file and line, or byte: cut short, too long, an index that names no
/// vertex, a face without corners, a coordinate that is not finite, a polygon that crosses itself,
/// no triangle at all.
Mesh load_mesh(const std::filesystem::path& path);

/// The same of a file's content; file: its name, for errors.
Mesh parse_ply_mesh(std::string_view bytes, const std::string& file);
/// Text or binary. Normals and attributes are passed over. Each named solid is a group.
Mesh parse_stl_mesh(std::string_view bytes, const std::string& file);
/// Faces; texture, normals, lines and points are passed over. Each name of g, o and usemtl is a
/// group. Free-form surfaces and calls of other files are refused.
Mesh parse_obj_mesh(std::string_view bytes, const std::string& file);

}  // namespace berth
