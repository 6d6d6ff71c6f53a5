// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/clouds/cloud.h"
#include "common/core/beam_model.h"

namespace berth::clouds {

void add_row(Cloud& cloud, const CloudRow& row) {
  ++cloud.counts.points;
  const double range = row.point.norm();
  constexpr double most_utime = 9e18;  // what 64 bits hold
  if (!std::isfinite(range) || !(std::abs(row.utime) < most_utime) || !std::isfinite(row.sigma)) {
    ++cloud.counts.not_finite;
    return;
  }
  if (!(range > 0)) {
    ++cloud.counts.at_sensor;
    return;
  }
  if (row.sigma < 0) {
    ++cloud.counts.bad_sigma;
    return;
  }
  CloudBeam beam;
  beam.utime = std::llround(row.utime);
  beam.range = range;
  beam_angles(row.point, beam.azimuth, beam.elevation);
  beam.hit = true;
  beam.range_sigma = row.sigma;
  cloud.beams.push_back(beam);
  ++cloud.counts.hits;
}

}  // namespace berth::clouds
