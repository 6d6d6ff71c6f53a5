// SPDX-License-Identifier: BSD-3-Clause
#include "common/targets/target.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/core/error.h"
#include "common/core/shared_files.h"
#include "common/core/text.h"
#include "common/meshes/mesh_file.h"
#include "common/targets/target_file.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

fs::path shipped_targets() { return shared_files() / "targets"; }

std::string names_of_targets() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(shipped_targets(), error)) {
    if (fs::exists(entry.path() / target_file)) names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return joined(names);
}

Target read_bare_mesh(const fs::path& path, double length) {
  Target target;
  target.name = path.stem().string();
  target.mesh = load_mesh(path);
  target.files = {path};
  if (const Box box = bounding_box(target.mesh); far_from_origin(box)) {
    target.file_origin = box.centre();
    for (Vector3d& v : target.mesh.vertices) v -= target.file_origin;
  }
  if (length > 0) target.mesh = scaled_to_length(target.mesh, length);
  return target;
}

}  // namespace

Pose turned(const Joint& joint, double angle) {
  const Quaterniond rotation = rotation_from_vector(joint.axis * angle);
  return {joint.point - rotation * joint.point, rotation};
}

const DockingPort* Target::port(const std::string& port_name) const {
  for (const DockingPort& one : ports) {
    if (port_name.empty() || one.name == port_name) return &one;
  }
  return nullptr;
}

bool is_target_name(const std::string& name) {
  const fs::path path(name);
  return !name.empty() && path == path.filename() &&
         fs::exists(shipped_targets() / path / target_file);
}

fs::path find_target(const std::string& name) {
  const fs::path path(name);
  if (is_target_name(name)) return shipped_targets() / path;
  if (fs::exists(path / target_file)) return fs::absolute(path);
  if (path.filename() == target_file && fs::exists(path)) return fs::absolute(path).parent_path();
  if (fs::is_directory(path)) {
    throw InputError("target '" + name + "': the folder has no " + target_file +
                     "; `berth target new MESH` makes one");
  }
  if (path.has_extension() && fs::exists(path)) return fs::absolute(path);
  throw InputError("target '" + name + "' is not there; expected a name of targets/ (" +
                   names_of_targets() + "), a folder with a " + target_file +
                   ", or a mesh file (PLY, STL, OBJ)");
}

Target load_target(const std::string& name, double length) {
  if (!(length >= 0) || !std::isfinite(length)) {
    throw InputError("target length: found " + std::to_string(length) +
                     " m, expected more than 0, or 0 for as it is");
  }
  const fs::path path = find_target(name);
  Target target =
      fs::is_directory(path) ? read_target_folder(path, length) : read_bare_mesh(path, length);
  target.length = bounding_box(target.mesh).size().maxCoeff();
  target.hash = content_hash(target.mesh);
  return target;
}

fs::path copy_target(const Target& target, const fs::path& into) {
  const bool folder = target.files.size() > 1;
  const fs::path kept = folder ? into / target.name : into / target.files.front().filename();
  try {
    fs::create_directories(folder ? kept : into);
    for (const fs::path& file : target.files) {
      copy_writable(file, folder ? kept / file.filename() : kept);
    }
  } catch (const fs::filesystem_error& e) {
    throw InputError("target '" + target.name + "' to " + kept.string() + ": " +
                     e.code().message());
  }
  return kept;
}

Mesh turned_mesh(const Target& target, const std::vector<double>& angles) {
  Mesh mesh = target.mesh;
  const auto turns = [&](std::uint16_t part) {
    return target.parts[part].joint.has_value() && angles[part] != 0;
  };
  // A vertex shared by several parts is kept by one and copied for the others.
  constexpr std::uint16_t no_part = 0xFFFF;
  std::vector<std::uint16_t> part_of_vertex(mesh.vertices.size(), no_part);
  std::map<std::pair<std::uint32_t, std::uint16_t>, std::uint32_t> copies;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::uint16_t part = target.part_index(i);
    for (std::uint32_t& v : mesh.triangles[i]) {
      if (part_of_vertex[v] == no_part) part_of_vertex[v] = part;
      const std::uint16_t of = part_of_vertex[v];
      if (of == part || (!turns(of) && !turns(part))) continue;
      const auto [copy, is_new] =
          copies.try_emplace({v, part}, static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) {
        const Vector3d vertex = mesh.vertices[v];
        mesh.vertices.push_back(vertex);
        part_of_vertex.push_back(part);
      }
      v = copy->second;
    }
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const std::uint16_t part = part_of_vertex[v];
    if (part == no_part || !turns(part)) continue;
    mesh.vertices[v] = turned(*target.parts[part].joint, angles[part]) * mesh.vertices[v];
  }
  return mesh;
}

Mesh swept_mesh(const Target& target) {
  const double step = radians(5);
  Mesh swept = target.mesh;
  for (std::size_t part = 1; part < target.parts.size(); ++part) {
    if (!target.parts[part].joint) continue;
    const Joint& joint = *target.parts[part].joint;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t i = 0; i < target.mesh.triangles.size(); ++i) {
      if (target.part_index(i) == part) triangles.push_back(i);
    }
    const Mesh own = cut_out(target.mesh, triangles);
    const int steps = static_cast<int>(std::ceil((joint.high - joint.low) / step));
    for (int i = 0; i <= steps; ++i) {
      const double angle =
          steps == 0 ? joint.low : joint.low + (joint.high - joint.low) * i / steps;
      swept.append(own, turned(joint, angle - joint.rest));
    }
  }
  return swept;
}

}  // namespace berth
