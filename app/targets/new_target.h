// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "common/core/mesh.h"

namespace berth {

/// A description of a mesh to begin with (docs/targets.md): its parts are the groups of the mesh,
/// or, where it has none, its connected components (triangles joined by vertices) with at least a
/// fiftieth of its surface, at most 20. Properties that a mesh does not determine are comments, as
/// an example.
/// @param mesh as long as it is held; file: its name next to the description
std::string described(const Mesh& mesh, const std::string& file);

/// Makes a folder that describes a target: the mesh, copied, and a target.yaml.
/// @param length m, of the largest side as held; 0: as the mesh is
/// @throws InputError when the folder is there, or the mesh cannot be read.
void make_target(const std::filesystem::path& mesh, const std::filesystem::path& folder,
                 double length);

}  // namespace berth
