// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/tracker_place.h"

#include <Eigen/Geometry>

namespace berth::testbed {

Pose place_tracker(const Cell& cell, const CalibrationRun& run) {
  std::vector<Vector3d> in_cell;
  std::vector<Vector3d> seen;
  for (const CalibrationRun::Reading& reading : run.readings) {
    const auto at = run.arm(reading.on).at(reading.time);
    if (!at) continue;
    in_cell.push_back(cell.arm(reading.on).tool_pose(at->joints) * reading.place);
    seen.push_back(reading.point);
  }
  if (seen.size() < 3) return {};
  Eigen::Matrix3Xd from(3, static_cast<Eigen::Index>(seen.size()));
  Eigen::Matrix3Xd to = from;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = in_cell[i];
    to.col(static_cast<Eigen::Index>(i)) = seen[i];
  }
  const Eigen::Matrix4d transform = Eigen::umeyama(from, to, false);
  const Matrix3d rotation = transform.topLeftCorner<3, 3>();
  return {transform.topRightCorner<3, 1>(), Quaterniond(rotation).normalized()};
}

}  // namespace berth::testbed
