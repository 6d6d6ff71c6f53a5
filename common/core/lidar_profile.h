// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

}  // namespace berth
