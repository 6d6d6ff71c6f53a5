// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/core/beam_model.h"
#include "common/core/run_setup.h"

namespace berth {

/// What one kind of scanning LIDAR can do: a file of config/lidars. Driver, simulator, estimator
/// and scan planner read the same one.
struct LidarProfile {
  std::string model;                ///< as the device names itself
  double field_of_view_width = 0;   ///< rad, along azimuth, centred on the boresight
  double field_of_view_height = 0;  ///< rad, along elevation
  double rate_hz = 0;               ///< beams per second
  double minimum_step_rad = 0;      ///< between neighbouring beams
  int beams_max = 0;                ///< in one scan
  BeamModel beam;
};

/// @throws InputError.
LidarProfile load_lidar_profile(const std::filesystem::path& path);
/// The LIDAR of a run: the one that its layout names, else the one named here.
/// @throws InputError.
LidarProfile load_lidar_profile(const RunSetup& run, const std::string& otherwise);

/// In the order of scan_window_t and of the LIDAR protocol.
enum class Pattern : std::int8_t { raster, spiral, rosette, lissajous };

/// A scan window: a rectangle in azimuth (to the right) and elevation (up), both 0 on the
/// boresight, and how to fill it with beams.
struct Window {
  double azimuth = 0;    ///< centre, rad
  double elevation = 0;  ///< centre, rad
  double width = 0;      ///< along azimuth, rad
  double height = 0;     ///< along elevation, rad
  Pattern pattern = Pattern::raster;
  std::int32_t count = 0;  ///< beams; 0: from spacing
  double spacing = 0;      ///< between neighbouring beams, rad; 0: from count
  std::string name;        ///< of the region of the model, or of its purpose
};

}  // namespace berth
