// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/model/closest_point_grid.h"
#include "estimator/model/lanes.h"

namespace berth::estimator {

/// Those of the points that a pose puts within the grid, by fours: the last four are filled up. m.
class TurnedPoints {
 public:
  static constexpr std::size_t lanes = 4;

  explicit TurnedPoints(std::size_t most) : voxels_(most + lanes) {
    for (std::vector<double>& axis : axes_) axis.resize(most + lanes);
  }

  /// @return how many they are.
  std::size_t turn(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                   const Pose& pose) {
    const Matrix3d rotation = pose.rotation.toRotationMatrix();
    const Vector3d& shift = pose.position;
    shift_ = {four(shift.x()), four(shift.y()), four(shift.z())};
    std::size_t count = 0;
    for (const Vector3d& point : points) {
      const Vector3d arm = rotation * point;
      const std::int64_t voxel = grid.voxel(arm + shift);
      if (voxel < 0) continue;
      put_at(count, arm, voxel);
      ++count;
    }
    for (std::size_t i = count; i < count + lanes; ++i) put_at(i, Vector3d::Zero(), 0);
    return count;
  }
  /// Turned as the pose turns them, but not shifted.
  Four3 arms(std::size_t from) const {
    return {four_at(&axes_[0][from]), four_at(&axes_[1][from]), four_at(&axes_[2][from])};
  }
  /// Where the pose puts them.
  Four3 places(std::size_t from) const { return arms(from) + shift_; }
  const std::int64_t* voxels_at(std::size_t from) const { return &voxels_[from]; }

 private:
  void put_at(std::size_t i, const Vector3d& arm, std::int64_t voxel) {
    for (std::size_t k = 0; k < 3; ++k) axes_[k][i] = arm[static_cast<Eigen::Index>(k)];
    voxels_[i] = voxel;
  }

  Four3 shift_{};
  std::array<std::vector<double>, 3> axes_;
  std::vector<std::int64_t> voxels_;
};

}  // namespace berth::estimator
