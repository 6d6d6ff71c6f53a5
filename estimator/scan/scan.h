// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "common/core/beam_model.h"
#include "common/core/lidar_profile.h"

namespace berth::estimator {

/// One beam as the LIDAR reports it.
struct RawBeam {
  std::int64_t utime = 0;  ///< us since the epoch
  double range = 0;        ///< m; 0 unless hit
  double azimuth = 0;      ///< rad, to the right
  double elevation = 0;    ///< rad, up
  BeamStatus status = BeamStatus::miss;
  double range_sigma = 0;   ///< m, where the sensor says it of each beam; 0: the beam model's
  double intensity = 0;     ///< of the return, on any scale; 0: not told
  double second_range = 0;  ///< m, of another return of the same beam; 0: there is none
  double second_range_sigma = 0;
  double second_intensity = 0;
};

}  // namespace berth::estimator
