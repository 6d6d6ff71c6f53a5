// SPDX-License-Identifier: BSD-3-Clause
#include "logs/report/scan_beams.h"

#include <berth/scan_packet_t.hpp>

#include "lcmtypes/channels.h"
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
    if (event.channel != channels::scan_data) continue;
    const auto packet = logs::decode<scan_packet_t>(event.data);
    if (!packet || packet->session != session || scans.count(packet->scan_id) == 0) continue;
    auto& of_scan = beams[packet->scan_id];
    for (std::size_t i = 0; i < packet->status.size(); ++i) {
      const bool hit = packet->status[i] == scan_packet_t::HIT;
      of_scan.push_back({packet->utime + packet->time_us[i],
                         hit ? static_cast<double>(packet->range_m[i]) : 0,
                         static_cast<double>(packet->azimuth_rad[i]),
                         static_cast<double>(packet->elevation_rad[i])});
    }
  }
  return beams;
}

}  // namespace berth::report
