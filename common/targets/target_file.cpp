// SPDX-License-Identifier: BSD-3-Clause
#include "common/targets/target_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <string_view>

#include "common/core/config.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/text.h"
#include "common/meshes/mesh_file.h"

namespace berth {
namespace {

/// A mesh whose length is the stated one to within this is not scaled, so that its content's hash
/// is the file's.
constexpr double rounding = 1e-9;

Joint read_joint(Config config) {
  Joint joint;
  joint.axis = config.vector("axis", Dimension::number);
  if (!(joint.axis.norm() > 0)) throw config.error("axis", "expected a direction, not zero");
  joint.axis.normalize();
  joint.point = config.vector("point", Dimension::length);
  const auto range = config.quantities("range", Dimension::angle);
  if (range.size() != 2 || !(range[0] <= range[1])) {
    throw config.error("range", "expected [least, greatest] angle");
  }
  joint.low = range[0];
  joint.high = range[1];
  joint.rest = std::clamp(0.0, joint.low, joint.high);
  config.optional("rest", Dimension::angle, joint.rest);
  if (!(joint.rest >= joint.low && joint.rest <= joint.high)) {
    throw config.error("rest", "expected an angle within the range");
  }
  config.finish();
  return joint;
}

/// Reads the keys that all parts may have.
void read_properties(Config& config, TargetPart& part) {
  config.optional("surface_sigma", Dimension::length, part.surface_sigma, at_least(0));
  config.optional("correlation_length", Dimension::length, part.correlation_length, above(0));
  read_material(config, part.material);
  config.optional_choice("scan", part.scan,
                         {{"prefer", ScanPreference::prefer},
                          {"avoid", ScanPreference::avoid},
                          {"none", ScanPreference::none}});
}

/// "7", or "0-11": indices of triangles, both ends included.
void add_faces(const Config& config, const std::string& text, std::size_t count,
               std::set<std::uint32_t>& faces) {
  const auto wrong = [&] {
    return config.error("faces", "found '" + text + "', expected indices of triangles from 0 to " +
                                     std::to_string(count - 1) + ", or a range as 0-11");
  };
  const std::size_t dash = std::min(text.find('-'), text.size());
  const auto index = [&](std::string_view digits) {
    std::uint32_t value = 0;
    const char* const end = digits.data() + digits.size();
    const auto read = std::from_chars(digits.data(), end, value);
    if (read.ec != std::errc() || read.ptr != end || value >= count) throw wrong();
    return value;
  };
  const std::string_view all = text;
  const std::uint32_t first = index(all.substr(0, dash));
  const std::uint32_t last = dash == all.size() ? first : index(all.substr(dash + 1));
  if (last < first) throw wrong();
  for (std::uint32_t i = first; i <= last; ++i) faces.insert(i);
}

/// The triangles of a mesh that a part names by group, box or list.
std::vector<std::uint32_t> faces_of(Config& config, const Mesh& mesh) {
  const int ways = config.has("group") + config.has("box") + config.has("faces");
  if (ways != 1) {
    throw config.error("box",
                       "expected one of 'group', 'box' and 'faces', found " + std::to_string(ways));
  }
  std::string name;
  config.optional("group", name);
  std::vector<std::string> texts;
  config.optional("faces", texts);
  std::vector<std::uint32_t> faces;
  if (config.has("group")) {
    std::vector<std::string> names;
    for (const MeshGroup& group : mesh.groups) {
      names.push_back(group.name);
      if (group.name != name) continue;
      faces.insert(faces.end(), group.triangles.begin(), group.triangles.end());
    }
    if (faces.empty()) {
      throw config.error("group", "the mesh has no group '" + name + "'; it has " +
                                      (names.empty() ? "none" : joined(names)));
    }
  } else if (config.has("box")) {
    Config box = config.optional_section("box");
    const Eigen::Array3d low = box.vector("low", Dimension::length);
    const Eigen::Array3d high = box.vector("high", Dimension::length);
    box.finish();
    if (!(low <= high).all()) throw config.error("box", "'low' must not be above 'high'");
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      const Eigen::Array3d centre =
          (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
      if ((centre >= low).all() && (centre <= high).all()) faces.push_back(i);
    }
    if (faces.empty()) throw config.error("box", "no face of the mesh has its centre in it");
  } else {
    std::set<std::uint32_t> listed;
    for (const std::string& text : texts) {
      add_faces(config, text, mesh.triangles.size(), listed);
    }
    faces.assign(listed.begin(), listed.end());
    if (faces.empty()) throw config.error("faces", "names no face");
  }
  return faces;
}

void read_parts(Config& config, Target& target) {
  Config default_part = config.optional_section("default_part");
  read_properties(default_part, target.parts[0]);
  default_part.finish();
  target.parts[0].name = "default";
  if (!config.has("parts")) return;
  constexpr std::size_t max_parts = 1000;
  Config parts = config.optional_section("parts");
  if (parts.keys().size() > max_parts) throw config.error("parts", "expected at most 1000");
  target.part_of.assign(target.mesh.triangles.size(), 0);
  for (auto& [name, config_of_part] : parts.named_sections()) {
    if (name == "default") throw parts.error(name, "is the name of 'default_part'");
    TargetPart part = target.parts[0];
    part.name = name;
    read_properties(config_of_part, part);
    const auto faces = faces_of(config_of_part, target.mesh);
    if (config_of_part.has("joint")) part.joint = read_joint(config_of_part.section("joint"));
    config_of_part.finish();
    const auto index = static_cast<std::uint16_t>(target.parts.size());
    bool any = false;
    for (const std::uint32_t face : faces) {
      if (target.part_of[face] != 0) continue;  // the first match counts
      target.part_of[face] = index;
      any = true;
    }
    if (!any) throw parts.error(name, "all its faces are of parts before it");
    target.parts.push_back(std::move(part));
  }
}

std::vector<DockingPort> ports_of(Config& config) {
  std::vector<DockingPort> ports;
  for (auto& [name, config_of_port] : config.optional_section("docking").named_sections()) {
    DockingPort port;
    port.name = name;
    port.pose = config_of_port.pose("pose");
    config_of_port.optional("approach_cone", Dimension::angle, port.approach_cone,
                            above(0).at_most(radians(90)));
    config_of_port.finish();
    ports.push_back(std::move(port));
  }
  return ports;
}

void scale(Target& target, double factor) {
  for (Vector3d& v : target.mesh.vertices) v *= factor;
  for (DockingPort& port : target.ports) port.pose.position *= factor;
  for (TargetPart& part : target.parts) {
    if (part.joint) part.joint->point *= factor;
  }
  if (target.mount) target.mount->position *= factor;
}

bool nearly(double a, double b) { return std::abs(a - b) <= rounding * b; }

}  // namespace

std::vector<DockingPort> read_ports(const std::string& text, const std::string& name,
                                    double length) {
  Config config = Config::parse(text, name);
  const double size = config.quantity("length", Dimension::length, above(0));
  std::vector<DockingPort> ports = ports_of(config);
  for (DockingPort& port : ports) port.pose.position *= nearly(size, length) ? 1 : length / size;
  return ports;
}

void read_material(Config& config, Material& material) {
  config.optional("reflectivity", material.reflectivity, within(0, 1));
  config.optional("specular", material.specular, within(0, 1));
  config.optional("roughness", Dimension::angle, material.roughness, within(1e-3, 1));
}

Target read_target_folder(const std::filesystem::path& folder, double length) {
  const std::filesystem::path file = folder / target_file;
  const std::string text = read_file(file);
  Config config = Config::parse(text, file.string());
  Target target;
  target.name = std::filesystem::absolute(folder).lexically_normal().filename().string();
  if (target.name.empty()) {  // of "folder/"
    target.name = std::filesystem::absolute(folder).lexically_normal().parent_path().filename();
  }
  target.description_hash = sha256(text);

  const std::filesystem::path mesh = config.text("mesh");
  if (mesh != mesh.filename()) {
    throw config.error("mesh", "found '" + mesh.string() + "', expected a file next to " +
                                   target_file + ": both go with a run");
  }
  target.files = {file, folder / mesh};
  target.mesh = load_mesh(target.files.back());
  const double size = config.quantity("length", Dimension::length, above(0));
  if (!nearly(bounding_box(target.mesh).size().maxCoeff(), size)) {
    target.mesh = scaled_to_length(target.mesh, size);
  }
  if (far_from_origin(bounding_box(target.mesh))) {
    throw config.error("mesh",
                       "its origin is far outside of the mesh, and poses here are of that "
                       "origin: move the origin into the mesh");
  }
  read_parts(config, target);
  target.ports = ports_of(config);
  Config mount = config.optional_section("mount");
  mount.optional("pose", target.mount);
  if (config.has("mount") && !target.mount) throw mount.error("pose", "is missing");
  mount.finish();
  config.finish();
  if (length > 0 && !nearly(size, length)) scale(target, length / size);

  std::vector<double> rest;
  for (const TargetPart& part : target.parts) rest.push_back(part.joint ? part.joint->rest : 0);
  if (std::any_of(rest.begin(), rest.end(), [](double angle) { return angle != 0; })) {
    target.mesh = turned_mesh(target, rest);
  }
  return target;
}

}  // namespace berth
