// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/planning/pose_information.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace berth::estimator {

PoseView::PoseView(const TargetModel& model, const BeamModel& beam, const Pose& pose,
                   double least_cosine)
    : model_(model),
      beam_(beam),
      to_model_(pose.inverse()),
      rotation_(to_model_.rotation.toRotationMatrix()),
      far_(std::min(beam.range_max_m, (model.centre - to_model_.position).norm() + model.radius)),
      least_cosine_(least_cosine) {}

void PoseView::roots(std::span<const Vector3d> directions, std::span<Vector6d> roots) const {
  constexpr std::size_t chunk = 64;  // beams at a time, on the stack
  const double az = beam_.azimuth_sigma_rad;
  const double el = beam_.elevation_sigma_rad;
  const double angle_variance = 0.5 * (az * az + el * el);
  const double range_variance = beam_.range_sigma_m * beam_.range_sigma_m;
  std::array<Ray, chunk> rays;
  std::array<RayHit, chunk> hits;
  for (std::size_t first = 0; first < directions.size(); first += chunk) {
    const std::size_t count = std::min(chunk, directions.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      rays[i] = {to_model_.position, rotation_ * directions[first + i]};
    }
    model_.caster.cast({rays.data(), count}, far_, hits);
    for (std::size_t i = 0; i < count; ++i) {
      const RayHit& hit = hits[i];
      Vector6d& root = roots[first + i];
      root.setZero();
      if (!std::isfinite(hit.range) || hit.range < beam_.range_min_m) continue;
      const Vector3d& direction = rays[i].direction;
      const double cosine = std::min(1.0, -direction.dot(hit.normal));
      if (cosine < least_cosine_) continue;
      // Across the surface; BeamModel's variance of the range is that over cosine^2.
      const double variance = cosine * cosine * range_variance +
                              hit.range * hit.range * (1 - cosine * cosine) * angle_variance;
      const Vector3d arm = to_model_.position + hit.range * direction;
      root << hit.normal, arm.cross(hit.normal) / model_.canonical.half_length;
      root /= std::sqrt(variance);
    }
  }
}

Matrix6d PoseView::pose_covariance(const Matrix6d& scaled) const {
  Matrix6d to_sensor = Matrix6d::Zero();
  to_sensor.topLeftCorner<3, 3>() = rotation_.transpose();
  to_sensor.bottomRightCorner<3, 3>() = rotation_.transpose() / model_.canonical.half_length;
  return to_sensor * scaled * to_sensor.transpose();
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

Matrix6d scan_information(const PoseView& view, const std::vector<Window>& windows, int* returns) {
  std::vector<Vector3d> directions;
  for (const Window& window : windows) append_raster(window, directions);
  std::vector<Vector6d> roots(directions.size());
  view.roots(directions, roots);
  Matrix6d information = Matrix6d::Zero();
  int count = 0;
  for (const Vector6d& root : roots) {
    if (root.isZero(0)) continue;
    information.noalias() += root * root.transpose();
    ++count;
  }
  if (returns != nullptr) *returns = count;
  return information;
}

}  // namespace berth::estimator
