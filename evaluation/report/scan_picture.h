// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/scan_window_t.hpp>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "common/bus/loop.h"
#include "common/core/ray_caster.h"
#include "evaluation/report/html.h"

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

/// One scan as it is drawn: the returns, in azimuth and elevation.
struct ScanPicture {
  std::string title;
  std::string caption;
  std::vector<scan_window_t> windows;
  std::vector<Beam> beams;
  std::vector<double> residuals;  ///< m, per beam: beyond the surface positive; NaN: no return
  std::optional<Pose> target;     ///< T_sensor_model where the target is drawn
  std::optional<Pose> estimate;   ///< its axes are drawn as well as the target's own
};

/// Signed distance of each return from the surface of the target at this pose, which moves with
/// this velocity from the time given. Returns further off than `elsewhere` are infinite.
std::vector<double> residuals_of(const std::vector<Beam>& beams, const RayCaster& target,
                                 const Pose& pose, const Velocity& velocity, Utime utime,
                                 double elsewhere);

/// The target shaded by how squarely it meets the line of sight, the windows, and each return
/// coloured by its residual: blue in front of the surface, orange beyond it.
Html html_of(const ScanPicture& picture, const RayCaster& target);

}  // namespace berth::report
