// SPDX-License-Identifier: BSD-3-Clause
#include "app/targets/new_target.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"
#include "common/core/yaml_text.h"
#include "common/meshes/mesh_file.h"
#include "common/targets/target.h"

namespace berth {
namespace {

constexpr std::size_t max_parts = 20;
constexpr double min_share = 0.02;  // of the surface

struct FoundPart {
  std::string name;
  std::string faces;  // "group: bus", or "faces: [0-11]"
  std::size_t count = 0;
  double area = 0;
};

double area_of(const Mesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const Vector3d& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

std::string key(const std::string& text) {
  YamlNode node(text);
  return flow_text(node);
}

/// Groups, each with the faces that no group before it has.
std::vector<FoundPart> parts_by_group(const Mesh& mesh) {
  std::vector<FoundPart> parts;
  std::vector<bool> taken(mesh.triangles.size());
  std::set<std::string> names;
  for (const MeshGroup& group : mesh.groups) {
    if (group.name == "default" || !names.insert(group.name).second) continue;
    FoundPart part{group.name, "group: " + key(group.name), 0, 0};
    for (const std::uint32_t triangle : group.triangles) {
      if (taken[triangle]) continue;
      taken[triangle] = true;
      ++part.count;
      part.area += area_of(mesh, triangle);
    }
    if (part.count > 0) parts.push_back(std::move(part));
  }
  return parts;
}

/// "[0-11, 15]"
std::string ranges(const std::vector<std::uint32_t>& ascending) {
  std::string text;
  for (std::size_t i = 0; i < ascending.size();) {
    std::size_t last = i;
    while (last + 1 < ascending.size() && ascending[last + 1] == ascending[last] + 1) ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(ascending[i]);
    if (last > i) text += "-" + std::to_string(ascending[last]);
    i = last + 1;
  }
  return "[" + text + "]";
}

/// Triangles that share vertices, the largest first.
std::vector<FoundPart> parts_by_connection(const Mesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    parent[root(t[0])] = root(t[1]);
    parent[root(t[1])] = root(t[2]);
  }
  struct Piece {
    std::vector<std::uint32_t> triangles;
    double area = 0;
  };
  std::map<std::uint32_t, Piece> pieces;
  double whole = 0;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    Piece& piece = pieces[root(mesh.triangles[i][0])];
    piece.triangles.push_back(i);
    piece.area += area_of(mesh, i);
    whole += area_of(mesh, i);
  }
  std::vector<const Piece*> order;
  for (const auto& [at, piece] : pieces) {
    if (piece.area >= min_share * whole) order.push_back(&piece);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const Piece* a, const Piece* b) { return a->area > b->area; });
  std::vector<FoundPart> parts;
  if (order.size() < 2) return parts;  // the default part is enough
  order.resize(std::min(order.size(), max_parts));
  for (const Piece* piece : order) {
    parts.push_back({"part_" + std::to_string(parts.size() + 1),
                     "faces: " + ranges(piece->triangles), piece->triangles.size(), piece->area});
  }
  return parts;
}

}  // namespace

std::string described(const Mesh& mesh, const std::string& file) {
  double whole = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) whole += area_of(mesh, i);
  const double length = bounding_box(mesh).size().maxCoeff();
  char text[64];
  std::snprintf(text, sizeof text, "%.17g m", length);
  std::string yaml =
      "# Properties of a target in addition to its mesh: docs/targets.md. `berth target check` and "
      "`draw` show it.\n"
      "mesh: " +
      key(file) + "\nlength: " + text +
      "   # largest side of the bounding box, as held\n\n"
      "# docking:                     # where a chaser may dock, any number\n"
      "#   aft:\n"
      "#     pose: [0, 0, 0, 0, 0, 0]   # T_model_port: x y z mm, w p r deg; z out of it\n"
      "#     approach_cone: 30 deg      # half angle about that z\n\n"
      "default_part:                  # of all that no part below claims\n"
      "  surface_sigma: 0.5 mm        # of the true surface about the mesh, along its normal\n"
      "  correlation_length: 300 mm   # over which it departs alike\n"
      "  reflectivity: 0.5            # diffuse\n"
      "# `berth target measure` finds these numbers from runs.\n";
  std::vector<FoundPart> parts = parts_by_group(mesh);
  if (parts.empty()) parts = parts_by_connection(mesh);
  const char* const example =
      "    # surface_sigma: 8 mm        # a blanket\n"
      "    # scan: avoid                # or prefer\n"
      "    # joint: {axis: [0, 1, 0], point: [0 mm, 0 mm, 0 mm], range: [-20 deg, 20 deg]}\n";
  if (parts.empty()) {
    return yaml +
           "\n# parts:                       # the first that claims a face has it\n"
           "#   array:\n"
           "#     box: {low: [0 mm, 0 mm, 0 mm], high: [100 mm, 100 mm, 100 mm]}\n" +
           example;
  }
  yaml += "\nparts:                         # the first that claims a face has it\n";
  bool first = true;
  for (const FoundPart& part : parts) {
    yaml += "  " + key(part.name) + ":   # " + std::to_string(part.count) + " faces, " +
            fixed(100 * part.area / whole, 1) + " % of the surface\n    " + part.faces + "\n";
    if (std::exchange(first, false)) yaml += example;
  }
  return yaml;
}

void make_target(const std::filesystem::path& mesh_file, const std::filesystem::path& folder,
                 double length) {
  if (!(length >= 0)) throw InputError("--length: expected more than 0 m");
  if (std::filesystem::exists(folder)) {
    throw InputError(folder.string() +
                     ": is there already, and is left as it is: --name names another");
  }
  Mesh mesh = load_mesh(mesh_file);
  if (length > 0) mesh = scaled_to_length(mesh, length);
  const std::filesystem::path name = mesh_file.filename();
  const std::string description = described(mesh, name.string());
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error) std::filesystem::copy_file(mesh_file, folder / name, error);
  if (error) throw InputError(folder.string() + ": " + error.message());
  write_file(folder / target_file, description);
  load_target(folder.string(), 0);  // what was written can be read
}

}  // namespace berth
