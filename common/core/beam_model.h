// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "common/core/pose.h"

namespace berth {

class Config;

/// Outcome of a beam, in the order of scan_packet2_t and of the LIDAR protocol.
enum class BeamStatus : std::uint8_t { hit, miss, too_near, too_far, saturated };

/// The noise and limits of one beam, shared by simulator, tracker and scan planner (DESIGN: one
/// model of the beam). Defaults: ILRIS-3D as in the paper, section 4.2, with noise case Error1 of
/// Table 1.
struct BeamModel {
  double range_sigma_m = 0.01;
  double range_bias_m = 0;  ///< 1 sigma of the error common to all ranges of a run
  double azimuth_sigma_rad = 1e-4;
  double elevation_sigma_rad = 1e-4;
  double divergence_rad = 0.17e-3;  ///< full angle
  double aperture_m = 0.012;        ///< beam width at the instrument
  double range_min_m = 3.0;
  double range_max_m = 800.0;
  double pulse_length_m = 0.5;  ///< surfaces in one beam nearer to each other than this: one echo
  double min_echo = 0.25;       ///< of a beam's strongest echo: weaker ones are not seen
  bool second_returns = false;  ///< the scanner reports the second return of a beam
  /// 1 sigma of the logarithm of a return's intensity about Lambert's law: reflectivity times the
  /// cosine of incidence over range^2. 0: intensity has no information.
  double intensity_sigma = 0;

  /// Variance (m^2) along the beam of a return from a surface at this range and incidence (rad from
  /// the normal): range noise, and angle noise seen through the surface's slope.
  double range_variance(double range, double incidence) const;
  /// Variance of the angle noise, rad^2: the mean over both directions.
  double angle_variance() const {
    return 0.5 *
           (azimuth_sigma_rad * azimuth_sigma_rad + elevation_sigma_rad * elevation_sigma_rad);
  }
  /// Width of the beam on a surface square to it, m.
  double footprint(double range) const { return aperture_m + divergence_rad * range; }
  /// Variance across an edge, m^2, of the place of a beam that half meets the surface: its
  /// footprint is four sigmas wide.
  double edge_variance(double range) const {
    const double spread = 0.25 * footprint(range);
    return spread * spread + angle_variance() * range * range;
  }
};

/// Direction of a beam in the sensor frame (x right, y down, z boresight):
/// (cos el sin az, -sin el, cos el cos az).
Vector3d beam_direction(double azimuth, double elevation);
/// Azimuth and elevation of a direction; its length does not matter.
void beam_angles(const Vector3d& direction, double& azimuth, double& elevation);

/// Reads a "beam" section.
BeamModel read_beam_model(const Config& section);

}  // namespace berth
