// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>

#include "common/core/beam_model.h"
#include "common/core/random.h"
#include "drivers/simulated/scene.h"

namespace berth {

/// How many rays stand for the light of one beam.
inline constexpr std::size_t rays_per_beam = 8;

/// A beam as rays of one power each: its middle, and seven about it at three quarters of its
/// radius, which part a beam of even light into equal areas. They leave from all over the aperture
/// and diverge, so that the footprint is aperture + divergence * range.
/// @param direction unit, sensor frame
std::array<Ray, rays_per_beam> rays_of_beam(const Vector3d& direction, const BeamModel& beam);

/// What the receiver makes one range of.
struct Echo {
  double range = 0;  ///< m, of the centre of its light
  double power = 0;  ///< 1: a white surface, square to the beam and filling it, at full scale
  SceneHit hit;      ///< where most of its light comes from
};

struct ReceiverSettings {
  double full_scale_range_m = 10;  ///< see Echo::power
  double least_echo = 0.25;        ///< of the strongest of a beam: weaker ones are not seen
  // Section `receiver` of a LIDAR's profile (config/lidars).
  double pulse_length_m = 0.5;        ///< echoes nearer to each other than this are one
  bool last_return = false;           ///< the last echo is reported, not the first
  double range_max_reflectivity = 0;  ///< of a surface just seen at the greatest range; 0: all are
};

/// Reads what a profile says of its receiver. @throws InputError.
void read_receiver(const std::filesystem::path& profile, ReceiverSettings& settings);

/// Light that comes back from the rays of one beam, parted by range into echoes a pulse's length
/// long; of these the first, or last, that is not too weak.
/// @param glitter draws how the mirrors of rough surfaces happen to lie: exponential, as for few of
/// many mirrors
std::optional<Echo> received_echo(const ReceiverSettings& settings, std::span<const SceneHit> hits,
                                  Random& glitter);

}  // namespace berth
