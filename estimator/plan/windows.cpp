// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/windows.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

Window window_between(double left, double right, double low, double high, int beams,
                      const std::string& name) {
  return {0.5 * (left + right),
          0.5 * (low + high),
          right - left,
          high - low,
          Pattern::raster,
          beams,
          0,
          name};
}

std::optional<Window> window_around(const ModelSphere& sphere, const Pose& pose,
                                    const FieldOfView& field, int beams, const std::string& name) {
  const Vector3d centre = pose * sphere.centre;
  const double range = centre.norm();
  if (!(centre.z() > 0)) return std::nullopt;
  Window window;
  beam_angles(centre, window.azimuth, window.elevation);
  const double half = sphere.radius < range ? std::asin(sphere.radius / range) : radians(90);
  const double left = std::max(window.azimuth - half, -0.5 * field.width);
  const double right = std::min(window.azimuth + half, 0.5 * field.width);
  const double low = std::max(window.elevation - half, -0.5 * field.height);
  const double high = std::min(window.elevation + half, 0.5 * field.height);
  if (right <= left || high <= low) return std::nullopt;
  return window_between(left, right, low, high, beams, name);
}

void append_raster(const Window& window, std::vector<Vector3d>& directions) {
  const int n = window.count;
  if (n < 1) return;
  int rows = n;
  if (window.height <= 0) {
    rows = 1;
  } else if (window.width > 0) {
    rows = std::clamp(static_cast<int>(std::lround(std::sqrt(n * window.height / window.width))), 1,
                      n);
  }
  const auto first_of = [&](int row) {
    return static_cast<int>(static_cast<std::int64_t>(row) * n / rows);
  };
  for (int row = 0; row < rows; ++row) {
    const int in_row = first_of(row + 1) - first_of(row);
    const double elevation = window.elevation - ((row + 0.5) / rows - 0.5) * window.height;
    for (int i = 0; i < in_row; ++i) {
      const double across = ((i + 0.5) / in_row - 0.5) * (row % 2 == 0 ? 1 : -1);
      directions.push_back(beam_direction(window.azimuth + across * window.width, elevation));
    }
  }
}

}  // namespace berth::estimator
