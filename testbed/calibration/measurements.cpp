// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/measurements.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

namespace berth::testbed {

void JointTrack::add(double t, const Joints& joints) {
  if (!times_.empty() && t <= times_.back()) return;
  times_.push_back(t);
  joints_.push_back(joints);
}

std::optional<JointTrack::State> JointTrack::at(double t) const {
  constexpr double max_gap = 0.1;
  const auto after = std::upper_bound(times_.begin(), times_.end(), t);
  if (after == times_.begin() || after == times_.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - times_.begin());
  const double gap = times_[i] - times_[i - 1];
  if (gap > max_gap) return std::nullopt;
  const double s = (t - times_[i - 1]) / gap;
  State state;
  for (std::size_t k = 0; k < 6; ++k) {
    const double change = joints_[i][k] - joints_[i - 1][k];
    state.joints[k] = joints_[i - 1][k] + s * change;
    state.rates[k] = change / gap;
  }
  return state;
}

namespace {

void note(std::vector<CalibrationResidual>& list, const std::string& kind, double size,
          const std::string& where) {
  auto found = std::find_if(list.begin(), list.end(),
                            [&](const CalibrationResidual& r) { return r.kind == kind; });
  if (found == list.end()) {
    list.push_back({kind, 0, 0, -1, ""});
    found = std::prev(list.end());
  }
  ++found->count;
  found->rms += size * size;
  if (size <= found->worst) return;
  found->worst = size;
  found->where = where;
}

}  // namespace

std::vector<CalibrationResidual> summarised(const std::vector<MeasurementResidual>& residuals) {
  std::vector<CalibrationResidual> list;
  for (const MeasurementResidual& residual : residuals) {
    note(list, residual.kind + ", position", residual.position, residual.where);
    if (residual.attitude) {
      note(list, residual.kind + ", attitude", *residual.attitude, residual.where);
    }
  }
  for (CalibrationResidual& residual : list) {
    residual.rms = std::sqrt(residual.rms / static_cast<double>(residual.count));
  }
  return list;
}

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
