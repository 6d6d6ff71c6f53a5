// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/ranges/short_range.h"

#include <algorithm>
#include <cmath>

#include "common/core/beam_model.h"
#include "common/core/error.h"

namespace berth::estimator {

std::optional<ModelSphere> docking_region(const TargetModel& model, const RangeOptions& options,
                                          const Pose& pose) {
  const double radius = options.docking_share * 2 * model.canonical.half_length;
  const auto& ports = model.target.ports;
  if (!options.docking_port.empty()) {
    const DockingPort* port = model.target.port(options.docking_port);
    if (port == nullptr) return std::nullopt;
    return ModelSphere{port->pose.position, radius};
  }
  const auto nearest =
      std::min_element(ports.begin(), ports.end(), [&](const DockingPort& a, const DockingPort& b) {
        return (pose * a.pose.position).norm() < (pose * b.pose.position).norm();
      });
  if (nearest == ports.end()) return std::nullopt;
  return ModelSphere{nearest->pose.position, radius};
}

void require_port(const Target& target, const RangeOptions& options) {
  if (options.docking_port.empty() || target.port(options.docking_port) != nullptr) return;
  std::string names;
  for (const DockingPort& port : target.ports) names += " " + port.name;
  throw InputError("estimator.yaml: ranges.docking_port '" + options.docking_port +
                   "' is not a docking port of target " + target.name + ", expected " +
                   (names.empty() ? "none: it has none" : "one of:" + names));
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

}  // namespace berth::estimator
