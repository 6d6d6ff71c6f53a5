// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/ranges/operating_range.h"

#include <algorithm>
#include <cmath>

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

}  // namespace berth::estimator
