// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/lidar_profile.h"

/// The paper's instrument.
inline berth::LidarProfile ilris() {
  berth::LidarProfile profile;
  profile.model = "ILRIS-3D";
  profile.field_of_view_width = berth::radians(40);
  profile.field_of_view_height = berth::radians(40);
  profile.rate_hz = 2000;
  profile.minimum_step_rad = 20e-6;
  profile.beams_max = 1000000;
  return profile;
}
