// SPDX-License-Identifier: BSD-3-Clause
#include "app/targets/target_report.h"

#include <algorithm>
#include <cmath>

#include "common/core/table.h"
#include "common/core/text.h"
#include "common/meshes/symmetry.h"

namespace berth {
namespace {

std::string shown_mm(double metres) { return shown(1e3 * metres); }

/// "[0, 120.5, -3] mm"
std::string shown_place(const Vector3d& place) {
  return "[" + fixed(1e3 * place.x(), 1) + ", " + fixed(1e3 * place.y(), 1) + ", " +
         fixed(1e3 * place.z(), 1) + "] mm";
}

std::string shown_direction(const Vector3d& d) {
  return "[" + fixed(d.x(), 3) + ", " + fixed(d.y(), 3) + ", " + fixed(d.z(), 3) + "]";
}

struct Extent {
  std::size_t faces = 0;
  double area = 0;
  Box box;
};

std::vector<Extent> extents_of(const Target& target) {
  std::vector<Extent> extents(target.parts.size());
  for (std::size_t i = 0; i < target.mesh.triangles.size(); ++i) {
    Extent& extent = extents[target.part_index(i)];
    const auto& t = target.mesh.triangles[i];
    const Vector3d& a = target.mesh.vertices[t[0]];
    if (extent.faces++ == 0) extent.box = {a, a};
    extent.area +=
        0.5 * (target.mesh.vertices[t[1]] - a).cross(target.mesh.vertices[t[2]] - a).norm();
    for (const std::uint32_t v : t) {
      extent.box.low = extent.box.low.cwiseMin(target.mesh.vertices[v]);
      extent.box.high = extent.box.high.cwiseMax(target.mesh.vertices[v]);
    }
  }
  return extents;
}

const char* text_of(ScanPreference scan) {
  return scan == ScanPreference::prefer ? "prefer" : scan == ScanPreference::avoid ? "avoid" : "";
}

std::string lines_of_symmetry(const SymmetryGroup& group) {
  if (group.trivial()) return "symmetry: none: no other pose shows the same surface\n";
  std::string text;
  if (group.revolution) {
    text += "symmetry: of revolution about " + shown_direction(group.revolution->direction) +
            " through " + shown_place(group.revolution->point) + "\n";
  }
  for (const Pose& motion : group.motions) {
    const Eigen::AngleAxisd turn(motion.rotation);
    text += "symmetry: turned by " + fixed(degrees(turn.angle()), 1) + " deg about " +
            shown_direction(turn.axis()) + "\n";
  }
  return text + "  (poses that these carry into each other are one to whoever judges)\n";
}

/// Whether whatever way one looks from there, part of the target is in the way.
bool is_inside(const RayCaster& caster, const Vector3d& place, double reach) {
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        if (!caster.occluded({place, Vector3d(x, y, z).normalized()}, reach)) return false;
      }
    }
  }
  return true;
}

void check_port(const Target& target, const RayCaster& caster, const DockingPort& port,
                std::vector<std::string>& doubts) {
  const std::string who = "port '" + port.name + "'";
  const Vector3d out = port.pose.rotation * Vector3d::UnitZ();
  const Vector3d place = port.pose.position + 1e-3 * target.length * out;
  const double reach = 2 * target.length;
  if (is_inside(caster, place, reach)) {
    doubts.push_back(who + " is inside of the surface: move it outwards along its z");
    return;
  }
  const double away = (caster.nearest(port.pose.position) - port.pose.position).norm();
  if (away > 0.1 * target.length) {
    doubts.push_back(who + " is " + shown_mm(away) +
                     " mm away from the surface: does it belong to another origin or unit (mm)?");
  }
  RayHit hit;
  if (caster.cast({place, out}, reach, hit)) {
    doubts.push_back(who + " looks into the surface: its z, " + shown_direction(out) +
                     ", meets part '" + target.part(hit.triangle).name + "' after " +
                     shown_mm(hit.range) + " mm; z must point out of it, towards the chaser");
  }
}

}  // namespace

std::string report_of(const Target& target) {
  const std::vector<Extent> extents = extents_of(target);
  double whole = 0;
  for (const Extent& extent : extents) whole += extent.area;
  std::string text = target.name + ": " + std::to_string(target.mesh.triangles.size()) +
                     " faces, " + shown(target.length) + " m long\n\n";
  Table table{"ll",
              {"part", "scan", "faces", "area", "surface sigma", "alike over", "reflectivity"}};
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const TargetPart& part = target.parts[i];
    table.rows.push_back(
        {part.name, text_of(part.scan), std::to_string(extents[i].faces),
         fixed(100 * extents[i].area / whole, 1) + " %", shown_mm(part.surface_sigma) + " mm",
         shown_mm(part.correlation_length) + " mm", shown(part.material.reflectivity)});
  }
  text += text_table(table) + "\n";
  for (const TargetPart& part : target.parts) {
    if (!part.joint) continue;
    text += "joint of '" + part.name + "': about " + shown_direction(part.joint->axis) +
            " through " + shown_place(part.joint->point) + ", " +
            fixed(degrees(part.joint->low), 1) + " to " + fixed(degrees(part.joint->high), 1) +
            " deg, at rest " + fixed(degrees(part.joint->rest), 1) + " deg\n";
  }
  for (const DockingPort& port : target.ports) {
    text += "port '" + port.name + "': at " + shown_place(port.pose.position) + ", looks along " +
            shown_direction(port.pose.rotation * Vector3d::UnitZ()) + ", cone " +
            fixed(degrees(port.approach_cone), 0) + " deg\n";
  }
  if (target.ports.empty()) text += "no docking port: nothing can dock\n";
  return text + lines_of_symmetry(find_symmetry(RayCaster(target.mesh)));
}

std::vector<std::string> doubts_about(const Target& target) {
  std::vector<std::string> doubts = target_notes(target);
  const RayCaster caster(target.mesh);
  const std::vector<Extent> extents = extents_of(target);
  for (std::size_t i = 1; i < target.parts.size(); ++i) {
    const TargetPart& part = target.parts[i];
    if (!part.joint) continue;
    const Joint& joint = *part.joint;
    const Vector3d from = extents[i].box.centre() - joint.point;
    const double away = (from - from.dot(joint.axis) * joint.axis).norm();
    if (away > extents[i].box.size().norm()) {
      doubts.push_back("the joint's axis is " + shown_mm(away) +
                       " mm away from the middle of part '" + part.name + "', which is " +
                       shown_mm(extents[i].box.size().norm()) +
                       " mm large: is `point` of another origin or unit?");
    }
  }
  for (const DockingPort& port : target.ports) check_port(target, caster, port, doubts);
  return doubts;
}

}  // namespace berth
