// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/sphere_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/core/text.h"

namespace berth::campaigns {
namespace {

using report::Html;
using report::markup;
using report::text;
using std::numbers::pi;
using std::numbers::sqrt2;

constexpr double scale = 100;  // units of the picture per unit of the projection
constexpr double margin = 16;
constexpr double width = 4 * sqrt2 * scale + 2 * margin;
constexpr double height = 2 * sqrt2 * scale + 2 * margin;

std::string place(double longitude, double latitude) {
  const auto [x, y] = hammer(longitude, latitude);
  char out[48];
  std::snprintf(out, sizeof out, "%.1f %.1f", width / 2 + scale * x, height / 2 - scale * y);
  return out;
}

/// The cell's edge, its curved sides in short pieces.
std::string outline(const SphereGrid::Cell& cell) {
  const auto pieces = [](double angle) {
    return static_cast<int>(std::ceil(std::abs(angle) / (pi / 24)));
  };
  std::string path = "M" + place(cell.west, cell.south);
  const auto side = [&](double west, double south, double east, double north) {
    const int count = std::max(1, pieces(std::max(std::abs(east - west), std::abs(north - south))));
    for (int i = 1; i <= count; ++i) {
      const double at = static_cast<double>(i) / count;
      path += "L" + place(std::lerp(west, east, at), std::lerp(south, north, at));
    }
  };
  side(cell.west, cell.south, cell.east, cell.south);
  side(cell.east, cell.south, cell.east, cell.north);
  side(cell.east, cell.north, cell.west, cell.north);
  side(cell.west, cell.north, cell.west, cell.south);
  return path + "Z";
}

/// Every 30 degrees, thin; drawn over the cells.
std::string lines() {
  std::string path;
  const auto line = [&path](double lon, double lat, double to_lon, double to_lat) {
    constexpr int count = 24;
    for (int i = 0; i <= count; ++i) {
      const double at = static_cast<double>(i) / count;
      path += (i == 0 ? "M" : "L") + place(std::lerp(lon, to_lon, at), std::lerp(lat, to_lat, at));
    }
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

std::string labels() {
  std::string svg;
  for (const Axis& axis : axes) {
    const auto [x, y] = hammer(axis.longitude, axis.latitude);
    char out[120];
    std::snprintf(out, sizeof out, "<text x=\"%.1f\" y=\"%.1f\">%s</text>", width / 2 + scale * x,
                  height / 2 - scale * y + 4, axis.name);
    svg += out;
  }
  return svg;
}

}  // namespace

std::array<double, 2> hammer(double longitude, double latitude) {
  const double wide = std::cos(latitude);
  const double size = std::sqrt(1 + wide * std::cos(longitude / 2));
  return {2 * sqrt2 * wide * std::sin(longitude / 2) / size, sqrt2 * std::sin(latitude) / size};
}

Html html_of(const SphereMap& map, const SphereGrid& grid, const report::ColourScale& scale_of) {
  Html html = markup("<figure class=\"sphere\"><figcaption><b>") + text(map.title) +
              markup("</b> ") + scale_of.legend() +
              markup("</figcaption><svg viewBox=\"0 0 " + fixed(width, 0) + " " + fixed(height, 0) +
                     "\" role=\"img\">\n");
  for (std::size_t i = 0; i < grid.size(); ++i) {
    html += markup("<path class=\"" + scale_of.class_of(map.values[i]) + "\" d=\"" +
                   outline(grid.cell(i)) + "\"><title>") +
            text(map.hovers[i]) + markup("</title></path>\n");
  }
  return html + markup("<path class=\"graticule\" d=\"" + lines() + "\"/>" + labels() +
                       "</svg></figure>\n");
}

Vector3d viewing_direction(const Quaterniond& q_sensor_model) {
  const Vector3d in_model = q_sensor_model.conjugate() * -Vector3d::UnitZ();
  return {-in_model.z(), in_model.x(), -in_model.y()};
}

Vector3d direction_in_model(const Vector3d& on_map) {
  return {on_map.y(), -on_map.z(), -on_map.x()};
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
