// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/material.h"

#include <cmath>

namespace berth {
namespace {

Material read_material(Config& config, Material material) {
  const auto share = [&config](const char* key, double& value) {
    config.optional(key, value);
    if (!(value >= 0 && value <= 1)) throw config.error(key, "expected 0 to 1");
  };
  share("reflectivity", material.reflectivity);
  share("specular", material.specular);
  config.optional("roughness", Dimension::angle, material.roughness);
  if (!(material.roughness >= 1e-3 && material.roughness <= 1)) {
    throw config.error("roughness", "expected 1 mrad to 1 rad");
  }
  return material;
}

TargetPart read_part(Config config) {
  TargetPart part;
  part.name = config.text("name");
  part.box.low = config.vector("low", Dimension::length);
  part.box.high = config.vector("high", Dimension::length);
  part.material = read_material(config, {});
  config.finish();
  if ((part.box.low.array() >= part.box.high.array()).any()) {
    throw config.error("high", "expected more than low in each of x, y and z");
  }
  return part;
}

}  // namespace

void read_scene_settings(Config& config, SceneSettings& settings) {
  if (config.has("materials")) {
    Config materials = config.section("materials");
    const std::pair<const char*, Material*> kinds[] = {{"target", &settings.target},
                                                       {"mount", &settings.mount},
                                                       {"arm", &settings.arm},
                                                       {"room", &settings.room}};
    for (const auto& [name, material] : kinds) {
      if (!materials.has(name)) continue;
      Config section = materials.section(name);
      *material = read_material(section, *material);
      section.finish();
    }
    materials.finish();
  }
  if (config.has("parts")) {
    Config targets = config.section("parts");
    for (const std::string& target : targets.keys()) {
      for (Config& part : targets.sections(target)) {
        settings.parts[target].push_back(read_part(std::move(part)));
      }
    }
    targets.finish();
  }
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
