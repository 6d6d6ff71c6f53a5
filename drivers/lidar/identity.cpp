// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/identity.h"

namespace berth::lidar {

Identity identity_of(const LidarProfile& profile, const std::string& serial) {
  Identity identity;
  identity.model = profile.model;
  identity.serial = serial;
  identity.rate_hz = profile.rate_hz;
  identity.range_min_m = profile.beam.range_min_m;
  identity.range_max_m = profile.beam.range_max_m;
  identity.field_of_view_rad[0] = profile.field_of_view_width;
  identity.field_of_view_rad[1] = profile.field_of_view_height;
  identity.minimum_step_rad = profile.minimum_step_rad;
  return identity;
}

}  // namespace berth::lidar
