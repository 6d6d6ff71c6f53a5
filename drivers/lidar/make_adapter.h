// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "common/core/lidar_profile.h"
#include "drivers/devices.h"
#include "drivers/lidar/adapter.h"

namespace berth::lidar {

/// The adapter that a device's configuration names. @throws InputError when there is nothing to
/// play back.
std::unique_ptr<Adapter> make_adapter(const LidarDevice& device, const LidarProfile& profile,
                                      Loop& loop);

}  // namespace berth::lidar
