// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/scan/preprocessing.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

namespace {

constexpr double nothing = std::numeric_limits<double>::infinity();

}  // namespace

CleanScan preprocess(const std::vector<RawBeam>& scan, const RangeGate& gate,
                     const BeamModel& beam_model) {
  CleanScan clean;
  clean.received = static_cast<int>(scan.size());
  clean.beams.reserve(scan.size());
  std::int64_t sum_of_times = 0;
  for (const RawBeam& raw : scan) {
    if (!std::isfinite(raw.azimuth) || !std::isfinite(raw.elevation)) {
      ++clean.invalid;
      continue;
    }
    Beam beam{beam_direction(raw.azimuth, raw.elevation), nothing, raw.utime, raw.range_sigma};
    if (raw.status == BeamStatus::miss || raw.status == BeamStatus::too_far) {
      ++clean.misses;
      clean.beams.push_back(beam);
      continue;
    }
    if (raw.status == BeamStatus::too_near) {
      ++clean.too_near;
      continue;
    }
    if (raw.status == BeamStatus::saturated) {
      ++clean.saturated;
      continue;
    }
    // written so that a NaN fails too
    if (!(raw.range > 0 && raw.range <= beam_model.range_max_m)) {
      ++clean.invalid;
      continue;
    }
    beam.range = raw.range;
    clean.beams.push_back(beam);
    if (raw.range < gate.near) {
      ++clean.nearer;
    } else if (raw.range > gate.far) {
      ++clean.farther;
    } else {
      clean.points.push_back(beam.point());
      clean.beam_of_point.push_back(static_cast<std::uint32_t>(clean.beams.size() - 1));
      if (clean.points.size() == 1) clean.utime_first = clean.utime_last = raw.utime;
      clean.utime_first = std::min(clean.utime_first, raw.utime);
      clean.utime_last = std::max(clean.utime_last, raw.utime);
      sum_of_times += raw.utime - scan.front().utime;
    }
  }
  if (!clean.points.empty()) {
    clean.utime_mean =
        scan.front().utime + sum_of_times / static_cast<std::int64_t>(clean.points.size());
  }
  return clean;
}

}  // namespace berth::estimator
