// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/material.h"

#include <cmath>

#include "common/targets/target_file.h"

namespace berth {

void read_scene_settings(Config& config, SceneSettings& settings) {
  Config materials = config.optional_section("materials");
  const std::pair<const char*, Material*> kinds[] = {
      {"mount", &settings.mount}, {"arm", &settings.arm}, {"room", &settings.room}};
  for (const auto& [name, material] : kinds) {
    Config section = materials.optional_section(name);
    read_material(section, *material);
    section.finish();
  }
  materials.finish();
}

double returned_share(const Material& material, double cosine, double glitter) {
  double share = material.reflectivity * cosine;
  if (material.specular > 0 && cosine > 0.1) {
    const double tangent2 = 1 / (cosine * cosine) - 1;
    const double slope2 = material.roughness * material.roughness;
    share += material.specular * glitter * std::exp(-0.5 * tangent2 / slope2) /
             (8 * slope2 * std::pow(cosine, 5));
  }
  return share;
}

}  // namespace berth
