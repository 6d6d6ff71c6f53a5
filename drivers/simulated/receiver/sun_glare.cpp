// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/sun_glare.h"

#include <algorithm>
#include <cmath>

namespace berth {

SunGlareSettings read_sun_glare(Config config) {
  SunGlareSettings settings;
  config.optional("lit_surface", settings.lit_surface, at_least(0));
  config.optional("albedo_surface", settings.albedo_surface, at_least(0));
  config.optional("in_aperture", settings.in_aperture, at_least(0));
  config.optional("glare_half_angle", Dimension::angle, settings.glare_half_angle, above(0));
  config.optional("half_lost", settings.half_lost, above(0));
  config.optional("early_share", settings.early_share, within(0, 1));
  config.finish();
  return settings;
}

double sun_background(const SunGlareSettings& settings, const Sunlight& sun, const Vector3d& beam,
                      const SceneHit* hit) {
  double background = 0;
  if (sun.level > 0 && sun.in_view) {
    const double angle = std::acos(std::clamp(beam.dot(sun.towards), -1.0, 1.0));
    const double x = angle / settings.glare_half_angle;
    background += sun.level * settings.in_aperture / (1 + x * x);
  }
  if (hit == nullptr) return background;
  const Material& material = hit->material;
  background += sun.albedo * settings.albedo_surface * (material.reflectivity + material.specular);
  const double facing = hit->normal.dot(sun.towards);
  if (sun.level > 0 && facing > 0) {
    double reflected = facing * material.reflectivity;
    if (material.specular > 0) {
      const Vector3d mirrored = 2 * facing * hit->normal - sun.towards;
      const double along = std::max(0.0, -beam.dot(mirrored));
      const double exponent = 0.25 / (material.roughness * material.roughness);
      reflected += material.specular * 0.5 * (exponent + 2) * std::pow(along, exponent);
    }
    background += sun.level * settings.lit_surface * reflected;
  }
  return background;
}

Glare glare_of(const SunGlareSettings& settings, double background, double signal) {
  if (background <= 0) return {};
  const double ratio = background / (signal > 0 ? signal : 1.0);
  const double lost = ratio * ratio / (ratio * ratio + settings.half_lost * settings.half_lost);
  return {std::sqrt(1 + ratio), lost * (1 - settings.early_share), lost * settings.early_share};
}

}  // namespace berth
