// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "common/core/mesh.h"

namespace berth {

/// A description of a mesh to begin with (docs/targets.md): its parts are the groups of the mesh,
/// or, where it has none, what hangs together (triangles joined by vertices) and is a fiftieth of
/// its surface at least, at most 20. What nobody can know of a mesh stands in comments, as an
/// example.
/// @param mesh as long as it is held; file: its name beside the description
std::string described(const Mesh& mesh, const std::string& file);

/// Makes a folder that describes a target: the mesh, copied, and a target.yaml.
/// @param length m, of the largest side as held; 0: as the mesh is
/// @throws InputError when the folder is there, or the mesh cannot be read.
void make_target(const std::filesystem::path& mesh, const std::filesystem::path& folder,
                 double length);

}  // namespace berth
