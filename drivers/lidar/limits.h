// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/core/lidar_profile.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// The Identity that a scanner of this profile sends.
Identity identity_of(const LidarProfile& profile, const std::string& serial);

/// A beam that lies so far outside its scan by the mapped clock is not believed.
inline constexpr Utime clock_tolerance = 5 * millisecond;

/// Empty when this kind of LIDAR can sweep these windows, else a sentence naming window, value and
/// limit. Driver and simulated device use the same one.
std::string check_windows(const LidarProfile& profile, const std::vector<Window>& windows);

/// Beams of one packet: so many, or, of a LIDAR so fast that it would send more than 400 packets a
/// second, what it measures in 2.5 ms; never more than fit a message.
int packet_size(const LidarProfile& profile, int usual);

}  // namespace berth::lidar
