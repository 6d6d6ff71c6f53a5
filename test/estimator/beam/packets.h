// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/beam/scan.h"
#include "lcmtypes/scan_packet.h"

namespace berth::estimator {

/// Packets of at most 50 beams, as the LIDAR driver would send them.
std::vector<ScanPacket> packets_of(const std::vector<RawBeam>& beams, std::int64_t scan_id,
                                   std::int64_t session = 0);

}  // namespace berth::estimator
