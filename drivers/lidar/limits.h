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

/// A beam whose mapped time is farther outside of its scan is rejected.
inline constexpr Utime clock_tolerance = 5 * millisecond;

/// Empty when this kind of LIDAR can sweep these windows, else a sentence naming window, value and
/// limit. Driver and simulated device use the same one.
std::string check_windows(const LidarProfile& profile, const std::vector<Window>& windows);

/// Beams of one packet: `usual`, or those of 2.5 ms for a LIDAR that would otherwise send more than
/// 400 packets a second; never more than fit into a message.
int packet_size(const LidarProfile& profile, int usual);

}  // namespace berth::lidar
