// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/scan/at_mean_time.h"

namespace berth::estimator {

CleanScan at_mean_time(const CleanScan& scan, const Velocity& velocity, const Vector3d& origin) {
  CleanScan still = scan;
  if (scan.points.empty() || (velocity.linear.isZero(0) && velocity.angular.isZero(0))) {
    return still;
  }
  const double distance = origin.norm();
  for (Beam& beam : still.beams) {
    const double late = static_cast<double>(beam.utime - scan.utime_mean) * 1e-6;
    const Vector3d point = beam.hit() ? beam.point() : Vector3d(distance * beam.direction);
    const Vector3d moved =
        point - late * (velocity.linear + velocity.angular.cross(point - origin));
    const double range = moved.norm();
    if (beam.hit()) beam.range = range;
    beam.direction = moved / range;
    beam.utime = scan.utime_mean;
  }
  for (std::size_t i = 0; i < still.points.size(); ++i) {
    still.points[i] = still.beams[still.beam_of_point[i]].point();
  }
  return still;
}

}  // namespace berth::estimator
