// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace berth {

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
