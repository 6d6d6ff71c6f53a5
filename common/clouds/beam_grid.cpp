// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/beam_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/beam_model.h"
#include "common/core/statistics.h"

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
  double misfit = 0;

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
    misfit = off.empty() ? turn : upper_median(off);
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

}  // namespace

BeamGrid::BeamGrid(const std::vector<Vector3d>& points, std::size_t rows) {
  const Fit about_y(points, rows, false);
  const Fit about_z(points, rows, true);
  about_z_ = about_z.misfit < about_y.misfit;
  const Fit& best = about_z_ ? about_z : about_y;
  longitude_ = best.longitude;
  latitude_ = best.latitude;
  misfit_ = best.misfit;
  // Beams may tremble by as much as a milliradian, or by half a step of the grid.
  const double step = std::max(step_of(longitude_), step_of(latitude_));
  regular_ = misfit_ < std::max(1e-3, 0.5 * step);
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

}  // namespace berth::clouds
