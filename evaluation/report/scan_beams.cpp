// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/scan_beams.h"

#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_reader.h"

namespace berth::report {

std::map<std::int64_t, std::vector<Beam>> read_beams(const std::filesystem::path& log,
                                                     std::int64_t session,
                                                     const std::set<std::int64_t>& scans) {
  std::map<std::int64_t, std::vector<Beam>> beams;
  if (scans.empty()) return beams;
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    const auto packet = logs::decode<ScanPacket>(event, channels::scan_data);
    if (!packet || packet->session != session || scans.count(packet->scan_id) == 0) continue;
    auto& of_scan = beams[packet->scan_id];
    for (std::size_t i = 0; i < packet->status.size(); ++i) {
      const bool hit = packet->status[i] == ScanPacket::HIT;
      const ScanPacket::Seen seen = packet->seen_from_sensor(i);
      of_scan.push_back(
          {packet->utime + packet->time_us[i], hit ? seen.range : 0, seen.azimuth, seen.elevation});
    }
  }
  return beams;
}

}  // namespace berth::report
