// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/clouds/cloud_builder.h"
#include "common/clouds/cloud_formats.h"
#include "common/clouds/text_lines.h"
#include "common/core/beam_model.h"
#include "common/core/statistics.h"
#include "common/core/text.h"

namespace berth::clouds {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr double turn = radians(360);

bool returned(const Vector3d& point) {
  const double range = point.norm();
  return range > 0 && std::isfinite(range);
}

/// Berth's own angles have their pole on y; turned, on z.
Vector3d to_pole_y(const Vector3d& v, bool about_z) {
  return about_z ? Vector3d(-v.y(), -v.z(), v.x()) : v;
}
Vector3d from_pole_y(const Vector3d& v, bool about_z) {
  return about_z ? Vector3d(v.z(), -v.x(), -v.y()) : v;
}

/// The angle that differs from this one by whole turns and lies nearest to the reference.
double unwrapped(double angle, double reference) {
  return angle - turn * std::round((angle - reference) / turn);
}

/// Fills in what is unknown: between neighbours on the straight line, outside on the line through
/// the nearest known ones with the slope of all (medians throughout).
void fill_gaps(std::vector<double>& values) {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values[i])) known.push_back(i);
  }
  if (known.size() < 2) return;
  for (std::size_t k = 0; k + 1 < known.size(); ++k) {
    const std::size_t a = known[k];
    const std::size_t b = known[k + 1];
    for (std::size_t i = a + 1; i < b; ++i) {
      const double s = static_cast<double>(i - a) / static_cast<double>(b - a);
      values[i] = values[a] + s * (values[b] - values[a]);
    }
  }
  const std::size_t half = known.size() / 2;
  std::vector<double> slopes;
  for (std::size_t k = 0; k + half < known.size(); ++k) {
    const std::size_t a = known[k];
    const std::size_t b = known[k + half];
    slopes.push_back((values[b] - values[a]) / static_cast<double>(b - a));
  }
  const double slope = upper_median(slopes);
  const auto extend = [&](std::size_t first, std::size_t last, bool at_start) {
    constexpr std::size_t max_anchors = 25;
    const std::size_t anchors = std::min(max_anchors, known.size());
    std::vector<double> offsets;
    for (std::size_t k = 0; k < anchors; ++k) {
      const std::size_t i = at_start ? known[k] : known[known.size() - 1 - k];
      offsets.push_back(values[i] - slope * static_cast<double>(i));
    }
    const double offset = upper_median(offsets);
    for (std::size_t i = first; i < last; ++i) values[i] = offset + slope * static_cast<double>(i);
  };
  extend(0, known.front(), true);
  extend(known.back() + 1, values.size(), false);
}

struct Fit {
  std::vector<double> longitude, latitude;
  double residual = 0;

  Fit(const std::vector<Vector3d>& points, std::size_t rows, bool about_z)
      : longitude(points.size() / rows, unknown), latitude(rows, unknown) {
    std::vector<std::vector<double>> by_row(rows);
    std::vector<double> of_column;
    double last = 0;
    for (std::size_t c = 0; c < longitude.size(); ++c) {
      of_column.clear();
      for (std::size_t r = 0; r < rows; ++r) {
        const Vector3d& point = points[c * rows + r];
        if (!returned(point)) continue;
        double lon = 0;
        double lat = 0;
        beam_angles(to_pole_y(point, about_z), lon, lat);
        by_row[r].push_back(lat);
        // next to the pole a longitude means nothing
        if (std::abs(lat) > radians(80)) continue;
        of_column.push_back(unwrapped(lon, of_column.empty() ? last : of_column.front()));
      }
      if (of_column.empty()) continue;
      longitude[c] = last = upper_median(of_column);
    }
    for (std::size_t r = 0; r < rows; ++r) {
      if (!by_row[r].empty()) latitude[r] = upper_median(by_row[r]);
    }
    std::vector<double> off;
    constexpr std::size_t max_checked = 20000;
    const std::size_t stride = 1 + points.size() / max_checked;
    for (std::size_t i = 0; i < points.size(); i += stride) {
      const double lon = longitude[i / rows];
      if (!returned(points[i]) || std::isnan(lon)) continue;
      const Vector3d expected = beam_direction(lon, latitude[i % rows]);
      const Vector3d found = to_pole_y(points[i].normalized(), about_z);
      off.push_back(std::atan2(expected.cross(found).norm(), expected.dot(found)));
    }
    residual = off.empty() ? turn : upper_median(off);
  }
};

/// Median step between neighbours that are both known; 0 without any.
double step_of(const std::vector<double>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    if (!std::isnan(step)) steps.push_back(step);
  }
  return steps.empty() ? 0 : upper_median(steps);
}

/// The directions of a scanner that sweeps columns and rows, learnt from the beams that returned:
/// all beams of a column share a longitude, all of a row a latitude, about the scanner's y axis
/// (Berth's sensor frame) or z axis (a surveyor's scanner), whichever fits. Columns and rows
/// without a return lie between, or in line with, the others.
class BeamGrid {
 public:
  /// points: column by column, zero or not finite where nothing came back; rows: of a column.
  BeamGrid(const std::vector<Vector3d>& points, std::size_t rows);

  /// Unit. @return false when it is unknown.
  bool direction(std::size_t column, std::size_t row, Vector3d& direction) const;
  /// Whether the returns lie on such a grid.
  bool regular() const { return regular_; }
  /// Median angle between the returns and the grid, rad.
  double residual_rad() const { return residual_; }

 private:
  bool about_z_ = false;
  bool regular_ = false;
  double residual_ = 0;
  std::vector<double> longitude_;  ///< of each column, rad; NaN: unknown
  std::vector<double> latitude_;   ///< of each row, rad; NaN: unknown
};

BeamGrid::BeamGrid(const std::vector<Vector3d>& points, std::size_t rows) {
  const Fit about_y(points, rows, false);
  const Fit about_z(points, rows, true);
  about_z_ = about_z.residual < about_y.residual;
  const Fit& best = about_z_ ? about_z : about_y;
  longitude_ = best.longitude;
  latitude_ = best.latitude;
  residual_ = best.residual;
  // Tolerance of a beam's direction: a milliradian or half a step of the grid, whichever is more.
  const double step = std::max(step_of(longitude_), step_of(latitude_));
  regular_ = residual_ < std::max(1e-3, 0.5 * step);
  fill_gaps(longitude_);
  fill_gaps(latitude_);
}

bool BeamGrid::direction(std::size_t column, std::size_t row, Vector3d& direction) const {
  const double longitude = longitude_[column];
  const double latitude = latitude_[row];
  if (!regular_ || std::isnan(longitude) || std::isnan(latitude)) return false;
  direction = from_pole_y(beam_direction(longitude, latitude), about_z_);
  return true;
}

/// The next line that holds anything.
bool next_line(TextLines& lines) {
  while (lines.next()) {
    if (!lines.cells().empty()) return true;
  }
  return false;
}

void expect_numbers(TextLines& lines, std::size_t count, const char* what) {
  if (!next_line(lines)) throw lines.error(std::string("the file ends, expected ") + what);
  if (lines.cells().size() != count) {
    throw lines.error("found " + std::to_string(lines.cells().size()) + " columns, expected " +
                      what);
  }
  for (std::size_t i = 0; i < count; ++i) lines.number(i, what);
}

std::size_t expect_count(TextLines& lines, const char* what) {
  expect_numbers(lines, 1, what);
  return lines.count(0, what);
}

}  // namespace

Cloud parse_ptx(std::string_view text, const std::string& file, const CloudOptions& options) {
  TextLines lines(text, file);
  const std::size_t columns = expect_count(lines, "the number of columns");
  const std::size_t rows = expect_count(lines, "the number of rows");
  expect_numbers(lines, 3, "the scanner's position: 3 numbers");
  for (int i = 0; i < 3; ++i) expect_numbers(lines, 3, "the scanner's axes: 3 lines of 3 numbers");
  for (int i = 0; i < 4; ++i) expect_numbers(lines, 4, "a matrix: 4 lines of 4 numbers");
  constexpr std::size_t shortest_line = 6;  // "0 0 0\n"
  const std::size_t beams = columns * rows;
  if (beams > lines.bytes_left() / shortest_line + 1) {
    throw lines.error("found a file too short for " + std::to_string(columns) + " columns of " +
                      std::to_string(rows) + " beams");
  }

  std::vector<Vector3d> points(beams);
  std::size_t width = 0;
  for (std::size_t i = 0; i < beams; ++i) {
    if (!next_line(lines)) {
      throw lines.error("the file ends after " + std::to_string(i) + " beams, expected " +
                        std::to_string(columns) + " columns of " + std::to_string(rows) + " beams");
    }
    if (i == 0) width = lines.cells().size();
    if (lines.cells().size() != width) {
      throw lines.error("found " + std::to_string(lines.cells().size()) + " columns, expected " +
                        std::to_string(width) + " as in the first beam");
    }
    points[i] = {lines.number(0, "x"), lines.number(1, "y"), lines.number(2, "z")};
  }
  if (next_line(lines)) {
    throw lines.error(lines.cells().size() == 1
                          ? "found a second scan, expected one a file: each has its own frame"
                          : "found more than the " + std::to_string(beams) +
                                " beams that columns and rows promise");
  }

  const BeamGrid grid(points, rows);
  const Columns first_three = Columns::first_three();
  CloudBuilder cloud(first_three, options);
  bool all_directed = true;
  for (std::size_t i = 0; i < beams; ++i) {
    if (points[i] != Vector3d::Zero()) {
      cloud.add({points[i]});
      continue;
    }
    Vector3d direction;
    const bool directed = grid.direction(i / rows, i % rows, direction);
    cloud.add_empty(directed ? &direction : nullptr);
    all_directed = all_directed && directed;
  }
  if (!all_directed) {
    cloud.note(grid.regular()
                   ? "the returns are too few to determine the direction of all empty beams"
                   : "the beams are no regular grid (" + fixed(1e3 * grid.residual_rad(), 1) +
                         " mrad off): the directions of the empty ones are unknown");
  }
  return cloud.finish();
}

}  // namespace berth::clouds
