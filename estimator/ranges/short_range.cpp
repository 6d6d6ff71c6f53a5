// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/ranges/short_range.h"

#include <algorithm>
#include <cmath>

#include "common/core/beam_model.h"

namespace berth::estimator {

std::optional<ModelSphere> docking_region(const TargetModel& model, double share,
                                          const Pose& pose) {
  const auto& ports = model.target.ports;
  const auto nearest =
      std::min_element(ports.begin(), ports.end(), [&](const DockingPort& a, const DockingPort& b) {
        return (pose * a.pose.position).norm() < (pose * b.pose.position).norm();
      });
  if (nearest == ports.end()) return std::nullopt;
  return ModelSphere{nearest->pose.position, share * 2 * model.canonical.half_length};
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
  return Window{0.5 * (left + right), 0.5 * (low + high), right - left, high - low, beams, name};
}

}  // namespace berth::estimator
