// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/sphere_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/text.h"

namespace berth::campaigns {
namespace {

using report::element;
using report::Html;
using report::text;
using std::numbers::pi;
using std::numbers::sqrt2;

constexpr double scale = 100;  // units of the picture per unit of the projection
constexpr double margin = 16;
constexpr double width = 4 * sqrt2 * scale + 2 * margin;
constexpr double height = 2 * sqrt2 * scale + 2 * margin;

std::array<double, 2> place(double longitude, double latitude) {
  const auto [x, y] = hammer(longitude, latitude);
  return {width / 2 + scale * x, height / 2 - scale * y};
}

void add(svg::Path& path, char command, double longitude, double latitude) {
  const auto [x, y] = place(longitude, latitude);
  path.add(command, {x, y});
}

/// A meridian or a parallel, without the place where it begins: curved, hence in short pieces.
void add_line(svg::Path& path, double west, double south, double east, double north) {
  const double angle = std::max(std::abs(east - west), std::abs(north - south));
  const int pieces = std::max(1, static_cast<int>(std::ceil(angle / (pi / 24))));
  for (int i = 1; i <= pieces; ++i) {
    const double at = static_cast<double>(i) / pieces;
    add(path, 'L', std::lerp(west, east, at), std::lerp(south, north, at));
  }
}

svg::Path outline(const SphereGrid::Cell& cell) {
  svg::Path path;
  add(path, 'M', cell.west, cell.south);
  add_line(path, cell.west, cell.south, cell.east, cell.south);
  add_line(path, cell.east, cell.south, cell.east, cell.north);
  add_line(path, cell.east, cell.north, cell.west, cell.north);
  add_line(path, cell.west, cell.north, cell.west, cell.south);
  return path.add('z');
}

/// Every 30 degrees, thin; drawn over the cells.
svg::Path graticule() {
  svg::Path path;
  const auto line = [&path](double west, double south, double east, double north) {
    add(path, 'M', west, south);
    add_line(path, west, south, east, north);
  };
  for (int i = -2; i <= 2; ++i) line(-pi, i * pi / 6, pi, i * pi / 6);
  for (int i = -6; i <= 6; ++i) line(i * pi / 6, -pi / 2, i * pi / 6, pi / 2);
  return path;
}

struct Axis {
  const char* name;
  double longitude;
  double latitude;
};
// The back is at both ends.
constexpr Axis axes[] = {{"−z", 0, 0},      {"+z", pi, 0},      {"+z", -pi, 0},
                         {"+x", pi / 2, 0}, {"−x", -pi / 2, 0}, {"−y", 0, pi / 2},
                         {"+y", 0, -pi / 2}};

Html labels() {
  Html html;
  for (const Axis& axis : axes) {
    const auto [x, y] = place(axis.longitude, axis.latitude);
    html += svg::element("text", {{"x", x}, {"y", y + 4}}, text(axis.name));
  }
  return html;
}

}  // namespace

SphereGrid::SphereGrid(std::size_t cells) {
  const double side = std::sqrt(4 * pi / static_cast<double>(std::max<std::size_t>(cells, 1)));
  const auto rings = static_cast<std::size_t>(std::max(1.0, std::round(pi / side)));
  std::vector<std::size_t> counts;
  std::size_t total = 0;
  for (std::size_t i = 0; i < rings; ++i) {
    const double polar = pi * (static_cast<double>(i) + 0.5) / static_cast<double>(rings);
    const double count = std::round(2 * pi * std::sin(polar) / side);
    counts.push_back(static_cast<std::size_t>(std::max(rings == 1 ? 1.0 : 3.0, count)));
    total += counts.back();
  }
  double north = 1;
  for (const std::size_t count : counts) {
    const std::size_t first = cells_.size();
    const double south = 1 - 2 * static_cast<double>(first + count) / static_cast<double>(total);
    rings_.push_back({south, first, count});
    for (std::size_t i = 0; i < count; ++i) {
      const double step = 2 * pi / static_cast<double>(count);
      const double west = -pi + static_cast<double>(i) * step;
      cells_.push_back({west, west + step, std::asin(std::max(-1.0, south)), std::asin(north)});
    }
    north = south;
  }
}

std::size_t SphereGrid::cell_at(const Vector3d& direction) const {
  const double z = direction.z() / direction.norm();
  auto ring = rings_.begin();
  while (z < ring->south_z && std::next(ring) != rings_.end()) ++ring;
  const double turn = (std::atan2(direction.y(), direction.x()) + pi) / (2 * pi);
  const auto place = static_cast<std::size_t>(turn * static_cast<double>(ring->count));
  return ring->first + std::min(place, ring->count - 1);
}

std::array<double, 2> hammer(double longitude, double latitude) {
  const double wide = std::cos(latitude);
  const double size = std::sqrt(1 + wide * std::cos(longitude / 2));
  return {2 * sqrt2 * wide * std::sin(longitude / 2) / size, sqrt2 * std::sin(latitude) / size};
}

Html picture_of(const SphereMap& map, const SphereGrid& grid, const report::ColourScale& scale_of) {
  Html drawing;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    drawing += svg::element(
        "path", {{"class", scale_of.class_of(map.values[i])}, {"d", outline(grid.cell(i))}},
        element("title", "", text(map.hovers[i])));
  }
  drawing += svg::element("path", {{"class", "graticule"}, {"d", graticule()}}) + labels();
  return element("figure", "sphere",
                 element("figcaption", "",
                         element("b", "", text(map.title)) + text(" ") + scale_of.legend()) +
                     svg::image(width, height, drawing)) +
         report::markup("\n");
}

Vector3d viewing_direction(const Quaterniond& q_sensor_model) {
  const Vector3d in_model = q_sensor_model.conjugate() * -Vector3d::UnitZ();
  return {-in_model.z(), in_model.x(), -in_model.y()};
}

Vector3d direction_in_model(const Vector3d& on_map) {
  return {on_map.y(), -on_map.z(), -on_map.x()};
}

Quaterniond upright_attitude(const Vector3d& on_map) {
  const Vector3d boresight = -direction_in_model(on_map).normalized();
  // Seen along y there is no upright: z of the model is as good as any.
  const Vector3d down =
      std::abs(boresight.y()) > 0.999 ? Vector3d(0, 0, boresight.y()) : Vector3d(0, 1, 0);
  const Vector3d y = (down - down.dot(boresight) * boresight).normalized();
  Matrix3d rotation;
  rotation.row(0) = y.cross(boresight);
  rotation.row(1) = y;
  rotation.row(2) = boresight;
  return Quaterniond(rotation);
}

double viewing_roll(const Quaterniond& q_sensor_model) {
  const Vector3d up = q_sensor_model * -Vector3d::UnitY();  // sensor: x right, y down
  return std::hypot(up.x(), up.y()) < 1e-9 ? 0 : std::atan2(up.x(), -up.y());
}

std::string name_of_direction(const Vector3d& on_map) {
  const Vector3d unit = on_map.normalized();
  const double right = degrees(std::atan2(unit.y(), unit.x()));
  const double up = degrees(std::asin(std::clamp(unit.z(), -1.0, 1.0)));
  return fixed(std::abs(right), 0) + "° " + (right < 0 ? "left" : "right") + ", " +
         fixed(std::abs(up), 0) + "° " + (up < 0 ? "down" : "up");
}

}  // namespace berth::campaigns
