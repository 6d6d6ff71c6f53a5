// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <vector>

#include "common/bus/loop.h"

namespace berth::report {

/// One beam of a scan: its first return, seen from the sensor's origin.
struct Beam {
  Utime utime = 0;
  double range = 0;  ///< m; 0 where nothing came back
  double azimuth = 0;
  double elevation = 0;
};

/// The beams of these scans of a session, by scan_id. @throws InputError when the log cannot be
/// read.
std::map<std::int64_t, std::vector<Beam>> read_beams(const std::filesystem::path& log,
                                                     std::int64_t session,
                                                     const std::set<std::int64_t>& scans);

}  // namespace berth::report
