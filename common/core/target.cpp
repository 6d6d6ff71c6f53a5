// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/target.h"

#include <cmath>
#include <utility>

#include "common/core/error.h"
#include "common/core/radarsat2.h"
#include "common/meshes/mesh_file.h"

namespace berth {

Target load_target(const std::string& name, double length) {
  if (!(length >= 0) || !std::isfinite(length)) {
    throw InputError("target length: found " + std::to_string(length) +
                     " m, expected more than 0, or 0 for as it is");
  }
  Target target;
  if (name == "radarsat2") {
    Radarsat2 replica = build_radarsat2(SymmetryBreaker::paper);
    target.name = name;
    target.mesh = std::move(replica.mesh);
    target.docking = replica.docking;
    target.has_docking_interface = true;
  } else {
    const std::filesystem::path path(name);
    if (!path.has_extension()) {
      throw InputError("target '" + name +
                       "' is not known; expected radarsat2 or a mesh file (.ply, .stl, .obj)");
    }
    target.name = path.stem().string();
    target.mesh = load_mesh(path);
    if (const Box box = bounding_box(target.mesh); far_from_origin(box)) {
      target.file_origin = box.centre();
      for (Vector3d& v : target.mesh.vertices) v -= target.file_origin;
    }
  }
  if (length > 0) {
    const double scale = length / bounding_box(target.mesh).size().maxCoeff();
    target.mesh = scaled_to_length(target.mesh, length);
    target.docking.position *= scale;
  }
  target.length = bounding_box(target.mesh).size().maxCoeff();
  target.hash = content_hash(target.mesh);
  return target;
}

}  // namespace berth
