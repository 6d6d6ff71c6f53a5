// SPDX-License-Identifier: BSD-3-Clause
#include "app/cell_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/svg.h"

namespace berth {
namespace {

constexpr double width = 1000;
constexpr double height = 600;
constexpr double focal = 780;  // pixels

struct Polygon {
  std::array<Vector3d, 3> corners;  // x, y in pixels, z depth
  std::string colour;
  double depth;
};

class Canvas {
 public:
  Canvas(const Vector3d& eye, const Vector3d& look_at) : eye_(eye) {
    forward_ = (look_at - eye).normalized();
    right_ = forward_.cross(Vector3d::UnitZ()).normalized();
    down_ = forward_.cross(right_);
  }

  Vector3d project(const Vector3d& point) const {
    const Vector3d d = point - eye_;
    const double depth = std::max(0.1, d.dot(forward_));
    return {width / 2 + focal * d.dot(right_) / depth, height / 2 + focal * d.dot(down_) / depth,
            depth};
  }

  void add(const Mesh& mesh, const Pose& placement, const svg::Colour& colour) {
    const Vector3d light = Vector3d(0.3, -0.7, 0.65).normalized();
    for (const auto& triangle : mesh.triangles) {
      std::array<Vector3d, 3> p;
      for (std::size_t i = 0; i < 3; ++i) p[i] = placement * mesh.vertices[triangle[i]];
      const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
      // Winding means nothing: the side towards the eye is lit.
      const double towards = normal.dot(eye_ - p[0]) < 0 ? -1 : 1;
      const double shade = 0.5 + 0.5 * std::max(0.0, towards * normal.dot(light));
      Polygon polygon{{project(p[0]), project(p[1]), project(p[2])}, svg::hex(colour, shade), 0};
      for (const auto& corner : polygon.corners) polygon.depth += corner.z() / 3;
      polygons_.push_back(polygon);
    }
  }

  svg::Markup polygons() {
    std::stable_sort(polygons_.begin(), polygons_.end(),
                     [](const Polygon& a, const Polygon& b) { return a.depth > b.depth; });
    svg::Markup paths;
    for (const auto& [c, colour, depth] : polygons_) {
      svg::Path outline;
      outline.add('M', {c[0].x(), c[0].y()}).add('L', {c[1].x(), c[1].y()});
      outline.add('L', {c[2].x(), c[2].y()}).add('z');
      // The stroke closes the hairlines between neighbours.
      paths += svg::element("path", {{"d", outline}, {"fill", colour}, {"stroke", colour}});
    }
    return svg::element("g", {{"stroke-width", 0.6}, {"stroke-linejoin", "round"}}, paths);
  }

 private:
  Vector3d eye_;
  Vector3d forward_;
  Vector3d right_;
  Vector3d down_;
  std::vector<Polygon> polygons_;
};

/// The floor as a grid of one metre; a large triangle would spoil the sorting.
svg::Markup floor_grid(const Canvas& canvas) {
  svg::Path lines;
  const auto line = [&](const Vector3d& a, const Vector3d& b) {
    const Vector3d p = canvas.project(a);
    const Vector3d q = canvas.project(b);
    lines.add('M', {p.x(), p.y()}).add('L', {q.x(), q.y()});
  };
  for (int x = -2; x <= 9; ++x) line({double(x), -3, 0}, {double(x), 4, 0});
  for (int y = -3; y <= 4; ++y) line({-2, double(y), 0}, {9, double(y), 0});
  return svg::element("path", {{"d", lines}, {"stroke", "#c9d1d8"}});
}

}  // namespace

std::string draw(const Cell& cell, const CellPicture& picture) {
  constexpr svg::Colour arm_colour{240, 200, 60};
  constexpr svg::Colour target_colour{205, 170, 110};
  constexpr svg::Colour mount_colour{120, 125, 130};
  constexpr svg::Colour sensor_colour{95, 120, 165};
  Canvas canvas(picture.eye, picture.look_at);
  const auto add_arm = [&](const PlacedArm& arm, const Joints& joints) {
    const auto links = arm.kinematics->link_poses(joints);
    for (const auto& body : arm.kinematics->bodies()) {
      canvas.add(body.mesh, arm.base * links[static_cast<std::size_t>(body.link)], arm_colour);
    }
  };
  add_arm(cell.replica, picture.replica);
  add_arm(cell.sensor, picture.sensor);
  const Pose replica_flange = cell.replica.base * cell.replica.kinematics->forward(picture.replica);
  const Pose sensor_flange = cell.sensor.base * cell.sensor.kinematics->forward(picture.sensor);
  canvas.add(cell.mount, replica_flange, mount_colour);
  canvas.add(cell.target.mesh, replica_flange * cell.replica.tool, target_colour);
  canvas.add(cell.sensor_housing, sensor_flange, sensor_colour);

  svg::Markup drawing;
  if (!cell.room.empty()) drawing += floor_grid(canvas);
  drawing += canvas.polygons();
  svg::Path returns;
  const Pose sensor = sensor_flange * cell.sensor.tool;
  for (const auto& point : picture.returns) {
    const Vector3d p = canvas.project(sensor * point);
    returns.dot(p.x(), p.y());
  }
  drawing += svg::element(
      "path",
      {{"d", returns}, {"stroke", "#d1232a"}, {"stroke-width", 2.6}, {"stroke-linecap", "round"}});
  drawing +=
      svg::element("text", {{"x", 16}, {"y", 584}, {"font-size", 15}}, svg::text(picture.caption));
  return svg::document(width, height, "#f7f9fb", drawing);
}

}  // namespace berth
