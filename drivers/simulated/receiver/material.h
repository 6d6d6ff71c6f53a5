// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "common/core/mesh.h"

namespace berth {

/// How a surface reflects light: a diffuse part (Lambert) and one as by small mirrors, whose slopes
/// about the surface are normally distributed. Paint: no mirrors; glass: smooth; foil: crinkled.
struct Material {
  double reflectivity = 0.5;    ///< diffuse, 0..1
  double specular = 0;          ///< as by mirrors, 0..1
  double roughness = 0.012910;  ///< rad, rms slope of the mirrors
};

/// Faces of a target that are of another material.
struct TargetPart {
  std::string name;
  Box box;  ///< model frame, m; the faces whose centre lies in it
  Material material;
};

/// What the simulated scene is made of: `materials` and `parts` of config/simulation_lidar.yaml.
struct SceneSettings {
  Material target{0.5, 0.3};
  Material mount{0.3};
  Material arm{0.3};
  Material room{0.6};
  std::map<std::string, std::vector<TargetPart>> parts;  ///< by the target's name
};

/// @throws InputError.
void read_scene_settings(Config& config, SceneSettings& settings);

/// Power that returns of a beam, over that from a white surface square to it at the same range:
/// Lambert's cosine, and Beckmann's distribution of slopes about the normal (monostatic, without
/// shadowing): specular * exp(-tan^2 / (2 roughness^2)) / (8 roughness^2 cosine^5).
/// @param glitter of the mirrors within the beam, mean 1.
double returned_share(const Material& material, double cosine, double glitter);

}  // namespace berth
