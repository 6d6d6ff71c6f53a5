// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/view_angles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/core/beam_model.h"

namespace berth::report {
namespace {

constexpr double paper_width = 640;
constexpr double paper_height = 420;
constexpr int cell = 2;  // units of the picture
constexpr int shades = 4;

}  // namespace

void AngleBox::add(double azimuth, double elevation) {
  left = std::min(left, azimuth);
  right = std::max(right, azimuth);
  bottom = std::min(bottom, elevation);
  top = std::max(top, elevation);
}

void AngleBox::add(const AngleBox& other) {
  if (other.empty()) return;
  add(other.left, other.bottom);
  add(other.right, other.top);
}

void AngleBox::widen(double part) {
  const double air = std::max(1e-6, part * std::max(right - left, top - bottom));
  left -= air;
  right += air;
  bottom -= air;
  top += air;
}

AngleBox angles_of(const Box& box, const Pose& T_sensor_model) {
  AngleBox angles;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Vector3d point((corner & 1u) != 0 ? box.high.x() : box.low.x(),
                         (corner & 2u) != 0 ? box.high.y() : box.low.y(),
                         (corner & 4u) != 0 ? box.high.z() : box.low.z());
    const Vector3d seen = T_sensor_model * point;
    if (seen.z() <= 0) return {};
    double azimuth = 0;
    double elevation = 0;
    beam_angles(seen, azimuth, elevation);
    angles.add(azimuth, elevation);
  }
  return angles;
}

View view_of(const AngleBox& box) {
  View view;
  view.box = box;
  if (box.empty()) view.box = {-0.1, 0.1, -0.1, 0.1};
  const double width = view.box.right - view.box.left;
  const double height = view.box.top - view.box.bottom;
  view.scale = std::min(paper_width / width, paper_height / height);
  view.width = view.scale * width;
  view.height = view.scale * height;
  return view;
}

svg::Markup shaded(const RayCaster& target, const Pose& T_sensor_model, const View& view) {
  const Pose inverse = T_sensor_model.inverse();
  const int columns = static_cast<int>(std::ceil(view.width / cell));
  const int rows = static_cast<int>(std::ceil(view.height / cell));
  std::vector<Ray> rays(static_cast<std::size_t>(columns));
  std::vector<RayHit> hits(rays.size());
  std::array<svg::Path, shades> paths;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double azimuth = view.box.left + (column + 0.5) * cell / view.scale;
      const double elevation = view.box.top - (row + 0.5) * cell / view.scale;
      rays[static_cast<std::size_t>(column)] = {
          inverse.position, inverse.rotation * beam_direction(azimuth, elevation)};
    }
    target.cast(rays, std::numeric_limits<double>::max(), hits);
    double begun = 0;
    int current = -1;
    for (int column = 0; column <= columns; ++column) {
      int shade = -1;
      if (column < columns && std::isfinite(hits[static_cast<std::size_t>(column)].range)) {
        const auto i = static_cast<std::size_t>(column);
        const double facing = std::abs(hits[i].normal.dot(rays[i].direction));
        shade = std::clamp(static_cast<int>(shades * (1 - facing)), 0, shades - 1);
      }
      if (shade == current) continue;
      if (current >= 0) {
        // A run of one shade is a level stroke, as wide as its row.
        paths[static_cast<std::size_t>(current)]
            .add('M', {begun * cell, (row + 0.5) * cell})
            .add('h', {(column - begun) * cell});
      }
      begun = column;
      current = shade;
    }
  }
  svg::Markup strokes;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    strokes += svg::element("path", {{"class", "s" + std::to_string(i)}, {"d", paths[i]}});
  }
  return svg::element("g", {{"class", "target"}}, strokes);
}

}  // namespace berth::report
