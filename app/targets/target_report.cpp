// SPDX-License-Identifier: BSD-3-Clause
#include "app/targets/target_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "common/core/ray_caster.h"
#include "common/core/svg.h"
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
  return text + "  (poses that these carry into each other count as one pose)\n";
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
                std::vector<std::string>& notes) {
  const std::string subject = "port '" + port.name + "'";
  const Vector3d out = port.pose.rotation * Vector3d::UnitZ();
  const Vector3d place = port.pose.position + 1e-3 * target.length * out;
  const double reach = 2 * target.length;
  if (is_inside(caster, place, reach)) {
    notes.push_back(subject + " is inside of the surface: move it outwards along its z");
    return;
  }
  const double away = (caster.nearest(port.pose.position) - port.pose.position).norm();
  if (away > 0.1 * target.length) {
    notes.push_back(subject + " is " + shown_mm(away) +
                    " mm away from the surface: does it belong to another origin or unit (mm)?");
  }
  RayHit hit;
  if (caster.cast({place, out}, reach, hit)) {
    notes.push_back(subject + " looks into the surface: its z, " + shown_direction(out) +
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

std::vector<std::string> validation_notes(const Target& target) {
  std::vector<std::string> notes = target_notes(target);
  const RayCaster caster(target.mesh);
  const std::vector<Extent> extents = extents_of(target);
  for (std::size_t i = 1; i < target.parts.size(); ++i) {
    const TargetPart& part = target.parts[i];
    if (!part.joint) continue;
    const Joint& joint = *part.joint;
    const Vector3d from = extents[i].box.centre() - joint.point;
    const double away = (from - from.dot(joint.axis) * joint.axis).norm();
    if (away > extents[i].box.size().norm()) {
      notes.push_back("the joint's axis is " + shown_mm(away) +
                      " mm away from the middle of part '" + part.name + "', which is " +
                      shown_mm(extents[i].box.size().norm()) +
                      " mm large: is `point` of another origin or unit?");
    }
  }
  for (const DockingPort& port : target.ports) check_port(target, caster, port, notes);
  return notes;
}

namespace {

constexpr int side = 300;  // of a view, pixels
constexpr int gap = 20;
constexpr int heading = 22;
constexpr int shades = 8;

constexpr const char* port_colour = "#c01820";
constexpr const char* symmetry_colour = "#7a7a7a";
constexpr std::array<svg::Colour, 10> colours = {{{190, 190, 190},
                                                  {86, 160, 211},
                                                  {240, 176, 66},
                                                  {98, 180, 120},
                                                  {214, 110, 150},
                                                  {150, 130, 210},
                                                  {205, 130, 80},
                                                  {90, 185, 190},
                                                  {180, 190, 80},
                                                  {160, 120, 120}}};

const svg::Colour& colour_of(std::size_t part) {
  return part == 0 ? colours[0] : colours[1 + (part - 1) % (colours.size() - 1)];
}

/// An orthographic view from one side.
struct View {
  const char* name;
  Vector3d forward;  // unit, model frame: where the eye looks
  Vector3d right;
  Vector3d down() const { return forward.cross(right); }
};

const std::array<View, 6> views = {{{"from +x", -Vector3d::UnitX(), Vector3d::UnitY()},
                                    {"from +y", -Vector3d::UnitY(), -Vector3d::UnitX()},
                                    {"from +z", -Vector3d::UnitZ(), Vector3d::UnitX()},
                                    {"from -x", Vector3d::UnitX(), -Vector3d::UnitY()},
                                    {"from -y", Vector3d::UnitY(), Vector3d::UnitX()},
                                    {"from -z", Vector3d::UnitZ(), -Vector3d::UnitX()}}};

class Painter {
 public:
  Painter(const Target& target, const RayCaster& caster, std::vector<RayCaster>& elsewhere,
          const SymmetryGroup& symmetry)
      : target_(target), caster_(caster), elsewhere_(elsewhere), symmetry_(symmetry) {
    const Box box = bounding_box(target.mesh);
    centre_ = box.centre();
    reach_ = 0.54 * box.size().maxCoeff();
    arrow_ = 0.35 * reach_;
    for (const DockingPort& port : target.ports) {
      const Vector3d tip = port.pose * Vector3d(0, 0, 1.1 * arrow_);
      reach_ = std::max(reach_, (tip - centre_).cwiseAbs().maxCoeff());
    }
  }

  svg::Markup paint(const View& view) {
    view_ = &view;
    svg::Markup drawing = svg::element(
        "rect", {{"width", side}, {"height", side}, {"fill", "#fbfcfd"}, {"stroke", "#d5dade"}});
    drawing += surface();
    if (symmetry_.revolution) {
      drawing += axis(symmetry_.revolution->point, symmetry_.revolution->direction, symmetry_colour,
                      "8 3 2 3");
    }
    for (const Pose& motion : symmetry_.motions) {
      const Eigen::AngleAxisd turn(motion.rotation);
      drawing += axis(fixed_point(motion), turn.axis(), symmetry_colour, "8 3 2 3");
    }
    for (const TargetPart& part : target_.parts) {
      if (part.joint) drawing += axis(part.joint->point, part.joint->axis, "#7b2fbf", "5 3");
    }
    for (const DockingPort& port : target_.ports) drawing += drawn(port);
    return drawing;
  }

 private:
  double scale() const { return 0.5 * side / reach_; }
  double x(const Vector3d& p) const { return 0.5 * side + scale() * view_->right.dot(p - centre_); }
  double y(const Vector3d& p) const {
    return 0.5 * side + scale() * view_->down().dot(p - centre_);
  }

  /// Of the axis of a turn: the point that it leaves where it is, nearest to the centre.
  Vector3d fixed_point(const Pose& motion) const {
    const Matrix3d turned = Matrix3d::Identity() - motion.rotation.toRotationMatrix();
    const Vector3d off = motion * centre_ - centre_;
    return centre_ + turned.completeOrthogonalDecomposition().solve(off);
  }

  svg::Markup axis(const Vector3d& point, const Vector3d& direction, const char* colour,
                   const char* dashes) const {
    const double along = direction.dot(centre_ - point);
    const Vector3d middle = point + along * direction;
    const Vector3d a = middle - 0.75 * reach_ * direction;
    const Vector3d b = middle + 0.75 * reach_ * direction;
    if (std::hypot(x(a) - x(b), y(a) - y(b)) < 4) {
      return svg::element("circle", {{"cx", x(a)},
                                     {"cy", y(a)},
                                     {"r", 4},
                                     {"fill", "none"},
                                     {"stroke", colour},
                                     {"stroke-width", 1.5}});
    }
    return line(a, b, colour, 1.3, dashes);
  }

  svg::Markup line(const Vector3d& a, const Vector3d& b, const char* colour, double width,
                   const char* dashes = "") const {
    return svg::element("path", {{"d", svg::Path().add('M', {x(a), y(a)}).add('L', {x(b), y(b)})},
                                 {"stroke", colour},
                                 {"stroke-width", width},
                                 {"stroke-dasharray", dashes}});
  }

  /// An arrow along z, and the cone's rim.
  svg::Markup drawn(const DockingPort& port) const {
    const Vector3d& at = port.pose.position;
    const auto place = [&](double along, double angle, double about) {
      return Vector3d(port.pose * Vector3d(along * std::sin(angle) * std::cos(about),
                                           along * std::sin(angle) * std::sin(about),
                                           along * std::cos(angle)));
    };
    svg::Path rim;
    for (int i = 0; i <= 36; ++i) {
      const Vector3d p = place(arrow_, port.approach_cone, radians(10) * i);
      rim.add(i == 0 ? 'M' : 'L', {x(p), y(p)});
    }
    const Vector3d tip = place(arrow_, 0, 0);
    const svg::Markup shapes =
        line(at, tip, port_colour, 2.2) +
        svg::element("path", {{"d", rim},
                              {"stroke", port_colour},
                              {"stroke-width", 0.8},
                              {"fill-opacity", "0.07"}}) +
        svg::element("circle", {{"cx", x(at)}, {"cy", y(at)}, {"r", 3}}) +
        svg::element("text", {{"x", x(tip) + 4}, {"y", y(tip) - 3}, {"font-size", 11}},
                     svg::text(port.name));
    return svg::element("g", {{"fill", port_colour}}, shapes);
  }

  /// A ray a pixel; runs of one colour are one stroke.
  svg::Markup surface() const {
    std::map<std::string, svg::Path> strokes;
    for (int row = 0; row < side; ++row) {
      std::string last;
      double begin = 0;
      for (int column = 0; column <= side; ++column) {
        const std::string colour = column == side ? "" : pixel(column, row);
        if (colour == last) continue;
        if (!last.empty()) strokes[last].add('M', {begin, row + 0.5}).add('h', {column - begin});
        last = colour;
        begin = column;
      }
    }
    svg::Markup paths;
    for (const auto& [colour, path] : strokes) {
      paths += svg::element("path", {{"stroke", colour}, {"d", path}});
    }
    return svg::element("g", {{"shape-rendering", "crispEdges"}}, paths);
  }

  std::string pixel(int column, int row) const {
    const double step = 1 / scale();
    const Vector3d origin = centre_ - 4 * reach_ * view_->forward +
                            step * (column + 0.5 - 0.5 * side) * view_->right +
                            step * (row + 0.5 - 0.5 * side) * view_->down();
    const Ray ray{origin, view_->forward};
    RayHit hit;
    if (!caster_.cast(ray, 8 * reach_, hit)) {
      const bool swept = std::any_of(elsewhere_.begin(), elsewhere_.end(), [&](const RayCaster& c) {
        return c.occluded(ray, 8 * reach_);
      });
      return swept ? "#e6dcf2" : "";
    }
    const std::size_t part = target_.part_index(hit.triangle);
    const double facing = -hit.normal.dot(ray.direction);
    const double shade = std::round(shades * (0.45 + 0.55 * facing)) / shades;
    const ScanPreference scan = target_.parts[part].scan;
    const bool stripe = (column + row) % 10 < 2;
    if (stripe && scan == ScanPreference::prefer) return svg::hex({30, 150, 60}, shade);
    if (stripe && scan == ScanPreference::avoid) return svg::hex({200, 40, 40}, shade);
    return svg::hex(colour_of(part), shade);
  }

  const Target& target_;
  const RayCaster& caster_;
  const std::vector<RayCaster>& elsewhere_;
  const SymmetryGroup& symmetry_;
  const View* view_ = nullptr;
  Vector3d centre_;
  double reach_ = 0;  // m, half of a view's side
  double arrow_ = 0;  // m, length of a port's arrow
};

}  // namespace

std::string draw(const Target& target) {
  const RayCaster caster(target.mesh);
  const SymmetryGroup symmetry = find_symmetry(caster);
  std::vector<RayCaster> elsewhere;  // joints at their ends
  for (const bool high : {false, true}) {
    std::vector<double> angles(target.parts.size(), 0);
    bool any = false;
    for (std::size_t i = 0; i < target.parts.size(); ++i) {
      const auto& joint = target.parts[i].joint;
      if (!joint) continue;
      angles[i] = (high ? joint->high : joint->low) - joint->rest;
      any = true;
    }
    if (any) elsewhere.emplace_back(turned_mesh(target, angles));
  }
  Painter painter(target, caster, elsewhere, symmetry);
  const int legend = 30 + 18 * static_cast<int>(target.parts.size());
  const int width = 3 * side + 4 * gap;
  const int height = 40 + 2 * (side + heading + gap) + legend;
  svg::Markup drawing = svg::element("text", {{"x", 20}, {"y", 27}, {"font-size", 17}},
                                     svg::text(target.name + ", " + shown(target.length) + " m"));
  for (std::size_t i = 0; i < views.size(); ++i) {
    const int x = gap + static_cast<int>(i % 3) * (side + gap);
    const int y = 40 + static_cast<int>(i / 3) * (side + heading + gap);
    drawing += svg::element("text", {{"x", x}, {"y", y + 14}, {"fill", "#555"}},
                            svg::text(views[i].name)) +
               svg::element("svg",  // cuts off what is beyond its sides
                            {{"x", x}, {"y", y + heading}, {"width", side}, {"height", side}},
                            painter.paint(views[i]));
  }
  int y = height - legend + 14;
  for (std::size_t i = 0; i < target.parts.size(); ++i, y += 18) {
    const TargetPart& part = target.parts[i];
    std::string text = part.name + ": " + shown(1e3 * part.surface_sigma) + " mm over " +
                       shown(1e3 * part.correlation_length) + " mm";
    if (part.joint) {
      text += ", turns " + fixed(degrees(part.joint->low), 0) + " to " +
              fixed(degrees(part.joint->high), 0) + " deg (dashed axis; pale where it may be)";
    }
    if (part.scan == ScanPreference::prefer) text += ", prefer (green stripes)";
    if (part.scan == ScanPreference::avoid) text += ", avoid (red stripes)";
    drawing += svg::element("rect", {{"x", 20},
                                     {"y", y - 11},
                                     {"width", 14},
                                     {"height", 14},
                                     {"fill", svg::hex(colour_of(i))}}) +
               svg::element("text", {{"x", 42}, {"y", y}}, svg::text(text));
  }
  if (!symmetry.trivial()) {
    drawing +=
        svg::element("text", {{"x", 640}, {"y", height - legend + 14}, {"fill", symmetry_colour}},
                     svg::text("dash-dotted: axes of symmetry"));
  }
  return svg::document(width, height, "#fff", drawing);
}

}  // namespace berth
