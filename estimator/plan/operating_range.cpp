// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/operating_range.h"

#include <algorithm>
#include <cmath>

#include "common/core/beam_model.h"
#include "common/core/error.h"

namespace berth::estimator {

RangeSwitch::RangeSwitch(const TargetModel& model, const LidarProfile& lidar,
                         const RangeOptions& options)
    : half_width_(0.5 * options.hysteresis) {
  const double half_length = model.canonical.half_length;
  // Beams that neither overlap nor are closer than the LIDAR can place them.
  const double step = std::max(lidar.minimum_step_rad, lidar.beam.divergence_rad);
  const double field = std::min(lidar.field_of_view_width, lidar.field_of_view_height);
  far_ = 2 * half_length / (options.medium_beams * step);
  near_ = half_length / std::tan(0.5 * field);
}

OperatingRange RangeSwitch::suited(double distance, OperatingRange now) const {
  const double in = 1 - half_width_;
  const double out = 1 + half_width_;
  if (distance > far_ * (now == OperatingRange::long_range ? in : out)) {
    return OperatingRange::long_range;
  }
  if (distance < near_ * (now == OperatingRange::short_range ? out : in)) {
    return OperatingRange::short_range;
  }
  return OperatingRange::medium_range;
}

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

}  // namespace berth::estimator
