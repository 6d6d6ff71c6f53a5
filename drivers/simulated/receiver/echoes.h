// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include "common/core/beam_model.h"
#include "common/core/random.h"
#include "drivers/simulated/receiver/scene.h"

namespace berth {

/// How many rays stand for the light of one beam.
inline constexpr std::size_t rays_per_beam = 8;

/// A beam as rays of one power each: its middle, and seven about it at three quarters of its
/// radius, which part a beam of even light into equal areas. They leave from all over the aperture
/// and diverge, so that the footprint is aperture + divergence * range.
/// @param direction unit, sensor frame
std::array<Ray, rays_per_beam> rays_of_beam(const Vector3d& direction, const BeamModel& beam);

/// What a receiver makes one range of.
struct Echo {
  double range = 0;  ///< m, of the centre of its light
  double power = 0;  ///< 1: a white surface, square to the beam and filling it, at full scale
  SceneHit hit;      ///< where most of its light comes from
};

/// How light is parted into echoes.
struct EchoSettings {
  double full_scale_range_m = 10;  ///< see Echo::power
  bool last_return = false;        ///< the last echo comes first
};

/// Of one beam, in the order of the receiver's interest: the first two.
struct Echoes {
  std::array<Echo, 2> echo;
  std::size_t count = 0;
};

/// Light that comes back from the rays of one beam, parted by range into echoes a pulse's length
/// long; those that are not too weak.
/// @param glitter draws how the mirrors of rough surfaces happen to lie: exponential, as for few of
/// many mirrors
Echoes received_echoes(const EchoSettings& settings, const BeamModel& beam,
                       std::span<const SceneHit> hits, Random& glitter);

}  // namespace berth
