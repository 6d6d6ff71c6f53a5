// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/limits.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drivers/lidar/protocol.h"
#include "drivers/lidar/scan_pattern.h"

namespace berth::lidar {

Identity identity_of(const LidarProfile& profile, const std::string& serial) {
  Identity identity;
  identity.model = profile.model;
  identity.serial = serial;
  identity.rate_hz = profile.rate_hz;
  identity.range_min_m = profile.beam.range_min_m;
  identity.range_max_m = profile.beam.range_max_m;
  identity.field_of_view_rad[0] = profile.field_of_view_width;
  identity.field_of_view_rad[1] = profile.field_of_view_height;
  identity.minimum_step_rad = profile.minimum_step_rad;
  return identity;
}

namespace {

std::string number(double value, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6g %s", value, unit);
  return text;
}

bool known(Pattern pattern) { return pattern >= Pattern::raster && pattern <= Pattern::lissajous; }

std::string check_side(const char* name, double centre, double size, double field) {
  const double reach = std::abs(centre) + 0.5 * size;
  if (reach <= 0.5 * field + 1e-9) return "";
  return std::string(name) + " reaches to " + number(degrees(reach), "deg") +
         ", field of view ends at " + number(degrees(0.5 * field), "deg");
}

std::string check_window(const LidarProfile& profile, const Window& w) {
  for (const double value : {w.azimuth, w.elevation, w.width, w.height, w.spacing}) {
    if (!std::isfinite(value)) return "a value is not finite";
  }
  if (w.width < 0 || w.height < 0) return "its size is negative";
  if (!known(w.pattern)) {
    return "pattern " + std::to_string(static_cast<int>(w.pattern)) + " is not known";
  }
  if (w.count < 0 || w.spacing < 0) return "count or spacing is negative";
  if (w.count == 0 && w.spacing == 0) return "neither count nor spacing is given";
  std::string why = check_side("azimuth", w.azimuth, w.width, profile.field_of_view_width);
  if (why.empty()) {
    why = check_side("elevation", w.elevation, w.height, profile.field_of_view_height);
  }
  if (!why.empty()) return why;
  const double step = beam_spacing(w);
  const bool stares = w.width == 0 && w.height == 0;
  if (!stares && step < profile.minimum_step_rad) {
    return "beams " + number(step * 1e6, "urad") + " apart, minimum step is " +
           number(profile.minimum_step_rad * 1e6, "urad");
  }
  return "";
}

}  // namespace

std::string check_windows(const LidarProfile& profile, const std::vector<Window>& windows) {
  if (windows.empty()) return "the scan has no window";
  if (windows.size() > max_windows) {
    return "the scan has " + std::to_string(windows.size()) + " windows, at most " +
           std::to_string(max_windows) + " are possible";
  }
  std::int64_t beams = 0;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const std::string why = check_window(profile, windows[i]);
    if (!why.empty()) return "window " + std::to_string(i) + ": " + why;
    beams += beam_count(windows[i]);
  }
  if (beams > profile.beams_max) {
    return "the scan has " + std::to_string(beams) + " beams, at most " +
           std::to_string(profile.beams_max) + " are possible";
  }
  return "";
}

int packet_size(const LidarProfile& profile, int usual) {
  constexpr double min_time = 2.5e-3;  // s
  const double fast =
      std::min(profile.rate_hz * min_time, static_cast<double>(max_beams_per_message));
  return std::max(usual, static_cast<int>(fast));
}

}  // namespace berth::lidar
