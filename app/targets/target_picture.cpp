// SPDX-License-Identifier: BSD-3-Clause
#include "app/targets/target_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "common/core/ray_caster.h"
#include "common/core/svg.h"
#include "common/core/text.h"
#include "common/meshes/symmetry.h"

namespace berth {
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
