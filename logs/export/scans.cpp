// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/scans.h"

#include <algorithm>

namespace berth::logs {

void ScanAssembler::take(const ScanPacket& packet) {
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
    const auto add = [&](float range, float sigma, std::int16_t intensity, float number) {
      const Eigen::Vector3f point = packet.point(i, range).cast<float>();
      scan_.points.push_back({point.x(), point.y(), point.z(), static_cast<float>(intensity), sigma,
                              packet.ambient[i], number, static_cast<double>(utime)});
    };
    if (packet.status[i] == ScanPacket::HIT) {
      add(packet.range_m[i], packet.range_sigma_m[i], packet.intensity[i], 1);
    }
    if (packet.range2_m[i] > 0) {
      add(packet.range2_m[i], packet.range2_sigma_m[i], packet.intensity2[i], 2);
    }
  }
  if (packet.scan_status != ScanPacket::RUNNING) finish();
}

void ScanAssembler::finish() {
  if (open_ && scan_.beams > 0) ready_(scan_);
  open_ = false;
}

}  // namespace berth::logs
