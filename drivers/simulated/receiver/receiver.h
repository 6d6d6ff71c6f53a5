// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <span>

#include "common/core/beam_model.h"
#include "common/core/random.h"
#include "drivers/simulated/receiver/scene.h"
#include "drivers/simulated/receiver/sun_glare.h"

namespace berth {

/// Number of rays that represent the light of one beam.
inline constexpr std::size_t rays_per_beam = 8;

/// A beam as rays of one power each: its middle, and seven about it at three quarters of its
/// radius, which part a beam of even light into equal areas. They leave from all over the aperture
/// and diverge, so that the footprint is aperture + divergence * range.
/// @param direction unit, sensor frame
std::array<Ray, rays_per_beam> rays_of_beam(const Vector3d& direction, const BeamModel& beam);

/// Light that gives one range.
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
/// @param glitter random stream of the specular power of rough surfaces: exponentially distributed,
/// as for few of many mirrors
Echoes received_echoes(const EchoSettings& settings, const BeamModel& beam,
                       std::span<const SceneHit> hits, Random& glitter);

/// How a scanner departs from its profile: section `scanner` of a world (config/worlds). All zero:
/// not at all.
struct ScannerErrors {
  bool footprint = false;       ///< a beam has the width of the beam model; else it is one ray
  int returns = 1;              ///< of a beam that are reported, 1 or 2; two need a footprint
  double range_bias = 0;        ///< m, in every range
  double range_step = 0;        ///< m: ranges are multiples of it
  double range_walk = 0;        ///< m by which a return of a tenth of the power reads farther
  double drop_out = 0;          ///< share of returns lost, square on
  double drop_out_grazing = 0;  ///< share of returns lost at an incidence of 80 deg
  double outliers = 0;          ///< share of beams with a random range
  double outlier_range = 15;    ///< m: such ranges lie evenly from the least range to here
};

/// @throws InputError.
ScannerErrors read_scanner_errors(Config config);

/// Share of returns lost at an incidence of that cosine c: d0 + (d80 - d0) ((1 - c) / (1 - c80))^4,
/// at most 1, with d0 square on and d80 at 80 deg. The exponent is an assumption: nearly as square
/// on up to 45 deg.
double drop_out_at(const ScannerErrors& errors, double cosine);

struct ReceiverSettings {
  double noise_scale = 1;  ///< on the beam model's three sigmas; 0: none
  EchoSettings echoes;
  double range_max_reflectivity = 0;  ///< just detected at the greatest range; 0: all are
  double min_power = 0;               ///< see Echo::power; weaker returns are lost, too
  /// Power, relative to a white surface in its place, above which there is no range.
  double saturation = 20;
  SunGlareSettings sun;
  ScannerErrors errors;
};

/// Reads the receiver of a LIDAR's profile (config/lidars). @throws InputError.
void read_receiver(const std::filesystem::path& profile, ReceiverSettings& settings);

/// Outcome of one beam.
struct Received {
  BeamStatus status = BeamStatus::miss;
  double range = 0;         ///< m, as reported; 0 unless hit
  double power = 0;         ///< see Echo::power; 0 unless hit or saturated
  double second_range = 0;  ///< m, of another echo of the same beam; 0: none
  double second_power = 0;
  double range_sigma = 0;  ///< m, of the beam model, times the effect of sunlight
  double background = 0;   ///< of sunlight, in units of power
  /// Where most of the light of `range` comes from; not met unless hit by it.
  SceneHit surface;
};

/// The receiver of a scanning LIDAR: turns the hits of rays into returns.
///
/// Noise, as in the paper's Table 1: the mirror points to the commanded angles plus the angle
/// errors, the device reports the commanded angles; the range error is added to the range met.
/// Returns nearer than the least range are too near, with range 0. A beam with a footprint may meet
/// several surfaces (echoes.h). Then, in this order: sunlight, range bias and walk, steps,
/// drop-out, outliers.
///
/// The number of draws per beam does not depend on the scene, so that two scenes with one seed have
/// the same noise; glitter, sunlight and the scanner's errors have streams of their own, so that
/// beams without these effects are unchanged.
class Receiver {
 public:
  Receiver(const BeamModel& beam, const ReceiverSettings& settings, std::uint64_t seed);

  /// @param azimuth, elevation rad, as commanded
  Received measure(Scene& scene, std::int64_t utime, double azimuth, double elevation,
                   const Sunlight& sun = {});

  // May be changed from beam to beam.
  BeamModel beam;
  ReceiverSettings settings;
  double range_noise = 1;  ///< on the sigma of range, times settings.noise_scale
  double angle_noise = 1;  ///< on those of both angles

 private:
  Echoes echoes_of(Scene& scene, std::int64_t utime, const Vector3d& direction);
  double reported_range(const Echo& echo, double error) const;
  void depart(Received& received);

  Random random_;
  Random glitter_random_;
  Random sun_random_;
  Random error_random_;
};

}  // namespace berth
