// SPDX-License-Identifier: BSD-3-Clause
#include "app/cell_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/core/valid_text.h"

namespace berth {
namespace {

constexpr double width = 1000;
constexpr double height = 600;
constexpr double focal = 780;  // pixels

struct Colour {
  double red, green, blue;
};

struct Polygon {
  std::array<Vector3d, 3> corners;  // x, y in pixels, z depth
  Colour colour;
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

  void add(const Mesh& mesh, const Pose& placement, const Colour& colour) {
    const Vector3d light = Vector3d(0.3, -0.7, 0.65).normalized();
    for (const auto& triangle : mesh.triangles) {
      std::array<Vector3d, 3> p;
      for (std::size_t i = 0; i < 3; ++i) p[i] = placement * mesh.vertices[triangle[i]];
      const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
      // Winding means nothing: the side towards the eye is lit.
      const double towards = normal.dot(eye_ - p[0]) < 0 ? -1 : 1;
      const double shade = 0.5 + 0.5 * std::max(0.0, towards * normal.dot(light));
      Polygon polygon{{project(p[0]), project(p[1]), project(p[2])},
                      {colour.red * shade, colour.green * shade, colour.blue * shade},
                      0};
      for (const auto& corner : polygon.corners) polygon.depth += corner.z() / 3;
      polygons_.push_back(polygon);
    }
  }

  std::string polygons() {
    std::stable_sort(polygons_.begin(), polygons_.end(),
                     [](const Polygon& a, const Polygon& b) { return a.depth > b.depth; });
    std::string out;
    char text[200];
    for (const auto& polygon : polygons_) {
      char fill[8];
      std::snprintf(fill, sizeof fill, "#%02x%02x%02x", static_cast<unsigned>(polygon.colour.red),
                    static_cast<unsigned>(polygon.colour.green),
                    static_cast<unsigned>(polygon.colour.blue));
      const auto& c = polygon.corners;
      // The stroke closes the hairlines between neighbours.
      std::snprintf(text, sizeof text,
                    "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fz\" fill=\"%s\" stroke=\"%s\"/>\n",
                    c[0].x(), c[0].y(), c[1].x(), c[1].y(), c[2].x(), c[2].y(), fill, fill);
      out += text;
    }
    return out;
  }

 private:
  Vector3d eye_;
  Vector3d forward_;
  Vector3d right_;
  Vector3d down_;
  std::vector<Polygon> polygons_;
};

/// The floor as a grid of one metre; a large triangle would spoil the sorting.
std::string floor_grid(const Canvas& canvas) {
  std::string out = "<g stroke=\"#c9d1d8\" stroke-width=\"1\">\n";
  const auto line = [&](const Vector3d& a, const Vector3d& b) {
    const Vector3d p = canvas.project(a);
    const Vector3d q = canvas.project(b);
    char text[160];
    std::snprintf(text, sizeof text, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n",
                  p.x(), p.y(), q.x(), q.y());
    out += text;
  };
  for (int x = -2; x <= 9; ++x) line({double(x), -3, 0}, {double(x), 4, 0});
  for (int y = -3; y <= 4; ++y) line({-2, double(y), 0}, {9, double(y), 0});
  return out + "</g>\n";
}

}  // namespace

std::string draw(const Cell& cell, const CellPicture& picture) {
  constexpr Colour arm_colour{240, 200, 60};
  constexpr Colour target_colour{205, 170, 110};
  constexpr Colour mount_colour{120, 125, 130};
  constexpr Colour sensor_colour{95, 120, 165};
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

  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1000 600\" "
      "font-family=\"DejaVu Sans, Helvetica, sans-serif\">\n"
      "<rect width=\"1000\" height=\"600\" fill=\"#f7f9fb\"/>\n";
  if (!cell.room.empty()) svg += floor_grid(canvas);
  svg += "<g stroke-width=\"0.6\" stroke-linejoin=\"round\">\n" + canvas.polygons() + "</g>\n";
  svg += "<g fill=\"#d1232a\">\n";
  const Pose sensor = sensor_flange * cell.sensor.tool;
  for (const auto& point : picture.returns) {
    const Vector3d p = canvas.project(sensor * point);
    char text[80];
    std::snprintf(text, sizeof text, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"1.3\"/>\n", p.x(), p.y());
    svg += text;
  }
  svg += "</g>\n<text x=\"16\" y=\"584\" font-size=\"15\" fill=\"#333\">" +
         markup_text(picture.caption) + "</text>\n</svg>\n";
  return svg;
}

}  // namespace berth
