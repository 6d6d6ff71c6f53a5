// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "common/core/lidar_profile.h"

namespace berth::lidar {

struct BeamAngles {
  double azimuth = 0;    ///< rad
  double elevation = 0;  ///< rad
};

/// Number of beams of a window: its count, or the number that follows from its size and spacing (at
/// least 1).
std::int64_t beam_count(const Window& window);
/// Distance between neighbouring beams, rad: the window's spacing, or the one that follows from its
/// size and count; 0 for a window without size.
double beam_spacing(const Window& window);

/// The beams of one window, one by one, none stored: beam i is fired i-th. All lie in the window.
/// Raster: rows from the top, swept to and fro, each beam in the middle of a cell of its own.
/// Spiral, rosette, Lissajous: in the ellipse (Lissajous: rectangle) that the window bounds, as
/// closely wound as makes neighbours along the curve and across it about equally far apart.
class ScanPattern {
 public:
  /// The window has passed check_windows (limits.h).
  explicit ScanPattern(const Window& window);

  std::int64_t size() const { return count_; }
  BeamAngles beam(std::int64_t i) const;

 private:
  /// Both in [-1, 1] over the window.
  BeamAngles raster(std::int64_t i) const;
  BeamAngles spiral(std::int64_t i) const;
  BeamAngles rosette(std::int64_t i) const;
  BeamAngles lissajous(std::int64_t i) const;

  Window window_;
  std::int64_t count_;
  std::int64_t rows_ = 1;  // raster
  double turns_ = 1;       // the others
};

}  // namespace berth::lidar
