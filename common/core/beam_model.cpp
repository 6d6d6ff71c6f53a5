// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/beam_model.h"

#include <algorithm>
#include <cmath>

#include "common/core/config.h"

namespace berth {

double BeamModel::range_variance(double range, double incidence) const {
  // Beyond 89 degrees no surface is flat enough for the slope to mean anything.
  const double slope = std::tan(std::clamp(incidence, 0.0, radians(89)));
  const double along = range * slope;
  return range_sigma_m * range_sigma_m + along * along * angle_variance();
}

Vector3d beam_direction(double azimuth, double elevation) {
  const double c = std::cos(elevation);
  return {c * std::sin(azimuth), -std::sin(elevation), c * std::cos(azimuth)};
}

void beam_angles(const Vector3d& direction, double& azimuth, double& elevation) {
  azimuth = std::atan2(direction.x(), direction.z());
  elevation = std::atan2(-direction.y(), std::hypot(direction.x(), direction.z()));
}

BeamModel read_beam_model(const Config& section) {
  Config config = section;
  BeamModel beam;
  config.optional("range_sigma", Dimension::length, beam.range_sigma_m, at_least(0));
  config.optional("range_bias", Dimension::length, beam.range_bias_m, at_least(0));
  config.optional("azimuth_sigma", Dimension::angle, beam.azimuth_sigma_rad, at_least(0));
  config.optional("elevation_sigma", Dimension::angle, beam.elevation_sigma_rad, at_least(0));
  config.optional("divergence", Dimension::angle, beam.divergence_rad, at_least(0));
  config.optional("aperture", Dimension::length, beam.aperture_m, at_least(0));
  config.optional("range_min", Dimension::length, beam.range_min_m, at_least(0));
  config.optional("range_max", Dimension::length, beam.range_max_m);
  config.optional("second_returns", beam.second_returns);
  config.optional("intensity_sigma", beam.intensity_sigma, at_least(0));
  config.finish();
  if (beam.range_max_m <= beam.range_min_m) {
    throw config.error("range_max", "is not more than range_min");
  }
  return beam;
}

}  // namespace berth
