// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/lidar_profile.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// What a scanner of this profile says of itself.
Identity identity_of(const LidarProfile& profile, const std::string& serial);

}  // namespace berth::lidar
