// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/lidar_profile.h"
#include "drivers/lidar/window.h"

namespace berth::lidar {

/// Empty when this kind of LIDAR can sweep these windows, else a sentence naming window, value and
/// limit. Driver and simulated device use the same one.
std::string check_windows(const LidarProfile& profile, const std::vector<Window>& windows);

}  // namespace berth::lidar
