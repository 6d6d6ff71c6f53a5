// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/planning/pose_information.h"

#include <algorithm>
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

bool PoseView::root(double azimuth, double elevation, Vector6d& root) const {
  const Vector3d direction = rotation_ * beam_direction(azimuth, elevation);
  RayHit hit;
  if (!model_.caster.cast({to_model_.position, direction}, far_, hit)) return false;
  const double cosine = std::min(1.0, -direction.dot(hit.normal));
  if (hit.range < beam_.range_min_m || cosine < least_cosine_) return false;
  const double variance = beam_.range_variance(hit.range, std::acos(cosine));
  const Vector3d arm = to_model_.position + hit.range * direction;
  root << hit.normal, arm.cross(hit.normal) / model_.canonical.half_length;
  root /= cosine * std::sqrt(variance);
  return true;
}

Matrix6d PoseView::pose_covariance(const Matrix6d& scaled) const {
  Matrix6d to_sensor = Matrix6d::Zero();
  to_sensor.topLeftCorner<3, 3>() = rotation_.transpose();
  to_sensor.bottomRightCorner<3, 3>() = rotation_.transpose() / model_.canonical.half_length;
  return to_sensor * scaled * to_sensor.transpose();
}

void raster_beam(const Window& window, int i, double& azimuth, double& elevation) {
  const int n = window.count;
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
  int row = static_cast<int>(static_cast<std::int64_t>(i) * rows / n);
  while (first_of(row + 1) <= i) ++row;
  const int in_row = first_of(row + 1) - first_of(row);
  const double across = (i - first_of(row) + 0.5) / in_row - 0.5;
  const double down = (row + 0.5) / rows - 0.5;
  azimuth = window.azimuth + (row % 2 == 0 ? across : -across) * window.width;
  elevation = window.elevation - down * window.height;
}

Matrix6d scan_information(const PoseView& view, const std::vector<Window>& windows, int* returns) {
  Matrix6d information = Matrix6d::Zero();
  int count = 0;
  Vector6d root;
  for (const Window& window : windows) {
    for (int i = 0; i < window.count; ++i) {
      double azimuth = 0;
      double elevation = 0;
      raster_beam(window, i, azimuth, elevation);
      if (!view.root(azimuth, elevation, root)) continue;
      information.noalias() += root * root.transpose();
      ++count;
    }
  }
  if (returns != nullptr) *returns = count;
  return information;
}

}  // namespace berth::estimator
