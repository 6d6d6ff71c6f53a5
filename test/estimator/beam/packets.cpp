// SPDX-License-Identifier: BSD-3-Clause
#include "test/estimator/beam/packets.h"

#include <algorithm>

namespace berth::estimator {

std::vector<ScanPacket> packets_of(const std::vector<RawBeam>& beams, std::int64_t scan_id,
                                   std::int64_t session) {
  constexpr std::size_t max_beams = 50;
  std::vector<ScanPacket> packets;
  for (std::size_t start = 0; start == 0 || start < beams.size(); start += max_beams) {
    const std::size_t end = std::min(beams.size(), start + max_beams);
    ScanPacket p{};
    p.session = session;
    p.scan_id = scan_id;
    p.packet = static_cast<std::int32_t>(packets.size());
    p.seq = p.packet;
    p.beams_before = static_cast<std::int32_t>(start);
    p.utime = start < end ? beams[start].utime : 0;
    p.resize(end - start);
    for (std::size_t i = start; i < end; ++i) {
      const std::size_t k = i - start;
      p.time_us[k] = static_cast<std::int32_t>(beams[i].utime - p.utime);
      p.range_m[k] = static_cast<float>(beams[i].range);
      p.azimuth_rad[k] = static_cast<float>(beams[i].azimuth);
      p.elevation_rad[k] = static_cast<float>(beams[i].elevation);
      p.intensity[k] = 1000;
      p.status[k] = static_cast<std::int8_t>(beams[i].status);
    }
    p.scan_status = end == beams.size() ? ScanPacket::COMPLETE : ScanPacket::RUNNING;
    packets.push_back(p);
  }
  return packets;
}

}  // namespace berth::estimator
