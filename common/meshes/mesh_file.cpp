// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/mesh_file.h"

#include <algorithm>
#include <cctype>

#include "common/core/error.h"
#include "common/core/file.h"

namespace berth {

Mesh load_mesh(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto parse = extension == ".ply"   ? parse_ply_mesh
                     : extension == ".stl" ? parse_stl_mesh
                     : extension == ".obj" ? parse_obj_mesh
                                           : nullptr;
  if (parse == nullptr) {
    throw InputError(path.string() + ": found '" + extension +
                     "', expected a .ply, .stl or .obj mesh");
  }
  if (!std::filesystem::exists(path)) throw InputError(path.string() + ": no such file");
  if (!std::filesystem::is_regular_file(path)) {
    throw InputError(path.string() + ": found a directory or device, expected a file");
  }
  return parse(read_file(path), path.string());
}

}  // namespace berth
