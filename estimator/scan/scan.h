// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/pose.h"
#include "common/core/raw_beam.h"

namespace berth::estimator {

using berth::BeamStatus;
using berth::RawBeam;

/// A rectangle in azimuth and elevation, swept with count beams.
struct Window {
  double azimuth = 0;    ///< centre, rad
  double elevation = 0;  ///< centre, rad
  double width = 0;      ///< rad
  double height = 0;     ///< rad
  int count = 0;         ///< beams
  std::string name;      ///< of the region or purpose
};

}  // namespace berth::estimator
