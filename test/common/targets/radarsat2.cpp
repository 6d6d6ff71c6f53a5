// SPDX-License-Identifier: BSD-3-Clause
#include "test/common/targets/radarsat2.h"

#include <cmath>

namespace berth {
namespace {

// Metres, at 1:5. Antenna frame while building: x along the antenna, y up, z to the back.
constexpr double antenna_length = 3.00;
constexpr double antenna_height = 0.30;
constexpr double antenna_thickness = 0.02;
constexpr double panel_gap = 0.01;
constexpr double bus_height = 0.74;
constexpr double bus_width = 0.272;
constexpr double array_length = 0.746;
constexpr double array_height = 0.36;
constexpr double array_thickness = 0.005;
constexpr double array_setback = 0.04;  // behind the antenna
constexpr double yoke_length = 0.10;
constexpr double strut_diameter = 0.008;
constexpr double ring_radius = 0.12;
constexpr double ring_height = 0.03;
constexpr double ring_wall = 0.015;
constexpr int ring_sides = 24;

/// How far bus and arrays stand above the antenna's centre line: distinguishes top from bottom.
double bus_offset(SymmetryBreaker breaker) {
  switch (breaker) {
    case SymmetryBreaker::none:
      return 0;
    case SymmetryBreaker::paper:
      return 0.12;
    case SymmetryBreaker::strong:
      return 0.24;
  }
  return 0;
}

Pose at(double x, double y, double z) { return {{x, y, z}, Quaterniond::Identity()}; }

void add_antenna(Mesh& mesh) {
  const double panel = (antenna_length - 3 * panel_gap) / 4;
  for (int i = 0; i < 4; ++i) {
    const double x = (i - 1.5) * (panel + panel_gap);
    mesh.append(make_box({panel, antenna_height, antenna_thickness}), at(x, 0, 0));
  }
}

void add_arrays(Mesh& mesh, double bus_y) {
  for (const double side : {-1.0, 1.0}) {
    const double inner = 0.5 * bus_width + yoke_length;
    mesh.append(make_box({array_length, array_height, array_thickness}),
                at(side * (inner + 0.5 * array_length), bus_y, array_setback));
    for (const double spread : {-1.0, 1.0}) {  // a yoke is a V from the bus to the array's edge
      mesh.append(make_strut({side * 0.5 * bus_width, bus_y, array_setback},
                             {side * inner, bus_y + spread * 0.12, array_setback}, 0.016));
    }
  }
}

/// The extendible support structure: four struts a side from the bus to the panels' ends.
void add_support(Mesh& mesh, double bus_y) {
  for (const double side : {-1.0, 1.0}) {
    for (const double end : {0.74, 1.49}) {
      for (const double up : {-1.0, 1.0}) {
        mesh.append(make_strut({side * 0.5 * bus_width, bus_y + up * 0.25, 0.5 * bus_width},
                               {side * end, up * 0.14, 0.5 * antenna_thickness}, strut_diameter));
      }
    }
  }
}

/// The launch-adapter ring on the front of the bus, open towards the chaser.
void add_ring(Mesh& mesh, double bus_y, bool lugs) {
  const double front = -0.5 * bus_width;
  const Pose centre = at(0, bus_y, front - 0.5 * ring_height);
  const Mesh outer = make_cylinder(ring_radius, ring_height, ring_sides, false);
  const Mesh inner = make_cylinder(ring_radius - ring_wall, ring_height, ring_sides, false);
  mesh.append(outer, centre);
  mesh.append(inner, centre);
  Mesh rim;  // the lower circles of both, joined
  const auto n = static_cast<std::uint32_t>(ring_sides);
  rim.vertices.assign(outer.vertices.begin(), outer.vertices.begin() + ring_sides);
  rim.vertices.insert(rim.vertices.end(), inner.vertices.begin(),
                      inner.vertices.begin() + ring_sides);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    rim.triangles.push_back({i, n + i, j});
    rim.triangles.push_back({j, n + i, n + j});
  }
  mesh.append(rim, centre);
  if (!lugs) return;
  const double heights[] = {0.02, 0.035, 0.05};
  for (int i = 0; i < 3; ++i) {
    const double angle = radians(90 + 120 * i);
    Pose place = at(ring_radius * std::cos(angle), bus_y + ring_radius * std::sin(angle),
                    front - ring_height - 0.5 * heights[i]);
    place.rotation = rotation_from_vector(Vector3d::UnitZ() * angle);
    mesh.append(make_box({0.02, 0.03 + 0.01 * i, heights[i]}), place);
  }
}

Vector3d surface_centroid(const Mesh& mesh) {
  Vector3d sum = Vector3d::Zero();
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double weight = (b - a).cross(c - a).norm();
    sum += weight * (a + b + c) / 3;
    area += weight;
  }
  return sum / area;
}

}  // namespace

Radarsat2 build_radarsat2(SymmetryBreaker breaker) {
  const double bus_y = bus_offset(breaker);
  Radarsat2 replica;
  Mesh& mesh = replica.mesh;
  add_antenna(mesh);
  mesh.append(make_box({bus_width, bus_height, bus_width}), at(0, bus_y, 0));
  add_arrays(mesh, bus_y);
  add_support(mesh, bus_y);
  add_ring(mesh, bus_y, breaker != SymmetryBreaker::none);
  if (breaker != SymmetryBreaker::none) {  // a star tracker and a downlink antenna on the upper end
    const double top = bus_y + 0.5 * bus_height;
    mesh.append(make_box({0.08, 0.06, 0.08}), at(0.06, top + 0.03, 0.05));
    mesh.append(make_cylinder(0.03, 0.05, 12), at(-0.07, top - 0.10, -0.5 * bus_width - 0.025));
  }
  if (breaker == SymmetryBreaker::strong) {
    mesh.append(make_box({0.20, 0.20, 0.30}), at(-0.90, 0.10, -0.5 * antenna_thickness - 0.15));
  }
  Vector3d origin = surface_centroid(mesh);
  if (breaker != SymmetryBreaker::strong) origin.x() = 0;
  for (auto& v : mesh.vertices) v -= origin;
  replica.docking.position = Vector3d(0, bus_y, -0.5 * bus_width - ring_height) - origin;
  replica.docking.rotation = Quaterniond(0, 1, 0, 0);  // half a turn about x: z looks out, along -z
  return replica;
}

Mesh make_radarsat2(SymmetryBreaker breaker) { return build_radarsat2(breaker).mesh; }

}  // namespace berth
