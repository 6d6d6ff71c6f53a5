// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/config.h"
#include "common/targets/target.h"

namespace berth {

/// Materials of the simulated scene: `materials` of config/simulation_lidar.yaml. Those of the
/// target are in its parts.
struct SceneSettings {
  Material mount{0.3};
  Material arm{0.3};
  Material room{0.6};
};

/// @throws InputError.
void read_scene_settings(Config& config, SceneSettings& settings);

/// Returned power of a beam, relative to that from a white surface square to it at the same range:
/// Lambert's cosine, and Beckmann's distribution of slopes about the normal (monostatic, without
/// shadowing): specular * exp(-tan^2 / (2 roughness^2)) / (8 roughness^2 cosine^5).
/// @param glitter of the mirrors within the beam, mean 1.
double returned_share(const Material& material, double cosine, double glitter);

}  // namespace berth
