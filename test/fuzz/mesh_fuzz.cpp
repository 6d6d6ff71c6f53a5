// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "common/core/error.h"
#include "common/meshes/mesh_file.h"
#include "common/targets/target.h"

using namespace berth;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

/// What is taken for a mesh is one: finite, used vertices, triangles and groups that exist.
void check(const Mesh& mesh, std::size_t bytes) {
  require(!mesh.triangles.empty() && mesh.vertices.size() <= 3 * mesh.triangles.size());
  require(mesh.triangles.size() + mesh.faces_without_area <= bytes);
  for (const Vector3d& v : mesh.vertices) require(v.allFinite());
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t index : t) require(index < mesh.vertices.size());
    require(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
  }
  for (const MeshGroup& group : mesh.groups) {
    require(!group.name.empty() && !group.triangles.empty());
    for (std::size_t i = 0; i < group.triangles.size(); ++i) {
      require(group.triangles[i] < mesh.triangles.size());
      require(i == 0 || group.triangles[i] > group.triangles[i - 1]);
    }
  }
}

}  // namespace

/// By its first byte the rest is a PLY, STL or OBJ file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  const auto parse = data[0] % 3 == 0   ? parse_ply_mesh
                     : data[0] % 3 == 1 ? parse_stl_mesh
                                        : parse_obj_mesh;
  try {
    Target target;
    target.mesh = parse(bytes, "fuzz");
    check(target.mesh, size);
    const Box box = bounding_box(target.mesh);
    target.length = box.size().maxCoeff();
    target_notes(target);
  } catch (const InputError&) {
  }
  return 0;
}
