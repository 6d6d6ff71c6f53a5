// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/config.h"
#include "drivers/simulated/receiver/scene.h"

namespace berth {

/// Effects of sunlight on the simulated LIDAR: section `sun` of config/simulation_lidar.yaml, where
/// each number has its source. Unit of background: the LIDAR's own light returned by a white
/// surface, square to the beam, at the full-scale range.
struct SunGlareSettings {
  double lit_surface = 0.005;           ///< of a white surface that faces the full lamp
  double albedo_surface = 0.001;        ///< of a white surface, of the full albedo lamp
  double in_aperture = 100;             ///< of the full lamp, looked into
  double glare_half_angle = 0.0174533;  ///< rad from the lamp at which that has fallen to a half
  double half_lost = 10;                ///< background over signal at which half the beams are lost
  double early_share = 0.3;             ///< of the lost: returns from noise, before the surface
};

/// @throws InputError.
SunGlareSettings read_sun_glare(Config config);

/// Effect on one beam.
struct Glare {
  double sigma_scale = 1;  ///< of the range noise
  double lost = 0;         ///< probability that its return is lost
  double early = 0;        ///< probability of a false return before it
};

/// Sunlight that reaches the receiver while it looks along a beam:
/// - reflected by the surface hit: diffuse (Lambert: the same from any range), and specular, a
///   normalised Phong lobe about the mirrored direction of the lamp, as wide as the material is
///   rough (exponent 1 / (4 roughness^2)). No shadows: what faces the lamp is lit;
/// - of the albedo lamp, which lights from all sides: diffuse and specular alike;
/// - scattered in the optics while the lamp shines into the aperture: 1 / (1 + (angle / half)^2),
///   the slope of 2 of Harvey's law for clean optics.
/// @param hit null when nothing is met.
double sun_background(const SunGlareSettings& settings, const Sunlight& sun, const Vector3d& beam,
                      const SceneHit* hit);

/// Shot noise of signal S and background B gives a range sigma that grows with sqrt(1 + B/S). The
/// share of lost beams rises with B/S as q^2 / (q^2 + half_lost^2).
/// @param signal of the return; a beam that meets nothing has none and competes with 1.
Glare glare_of(const SunGlareSettings& settings, double background, double signal);

}  // namespace berth
