// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/scans.h"

#include <algorithm>
#include <cmath>

namespace berth::logs {

void ScanAssembler::take(const scan_packet_t& packet) {
  if (open_ && (packet.scan_id != scan_.scan_id || packet.session != scan_.session)) finish();
  if (!open_) {
    scan_ = {};
    scan_.session = packet.session;
    scan_.scan_id = packet.scan_id;
    scan_.utime = packet.utime;
    next_packet_ = 0;
    open_ = true;
  }
  if (packet.packet < next_packet_) return;  // a repeat
  scan_.packets_missing += packet.packet - next_packet_;
  next_packet_ = packet.packet + 1;
  scan_.beams += packet.count;
  for (std::size_t i = 0; i < packet.status.size(); ++i) {
    const Utime utime = packet.utime + packet.time_us[i];
    scan_.utime_end = std::max(scan_.utime_end, utime);
    if (packet.status[i] != scan_packet_t::HIT) continue;
    const double azimuth = static_cast<double>(packet.azimuth_rad[i]);
    const double elevation = static_cast<double>(packet.elevation_rad[i]);
    const double range = static_cast<double>(packet.range_m[i]);
    const double flat = range * std::cos(elevation);
    scan_.points.push_back({static_cast<float>(flat * std::sin(azimuth)),
                            static_cast<float>(-range * std::sin(elevation)),
                            static_cast<float>(flat * std::cos(azimuth)),
                            static_cast<float>(packet.intensity[i]), static_cast<double>(utime)});
  }
  if (packet.scan_status != scan_packet_t::RUNNING) finish();
}

void ScanAssembler::finish() {
  if (open_ && scan_.beams > 0) ready_(scan_);
  open_ = false;
}

}  // namespace berth::logs
