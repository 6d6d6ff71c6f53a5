// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "estimator/model/closest_point_grid.h"

namespace berth::estimator {

/// Distances to the visible surface, cut off and stored in a byte a voxel: to be read some hundred
/// thousand times while a pose is searched, it has to fit into the processor's cache. Model frame.
class DistanceTable {
 public:
  static constexpr int most = 255;  ///< the value at and beyond the cut-off

  /// cut_off: m.
  DistanceTable(const ClosestPointGrid& grid, double cut_off);

  /// Of a point of the model frame, in units of cut_off / 255.
  int value(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f place = (point - low_) / cell_;
    return values_[static_cast<std::size_t>(index(place.x(), place.y(), place.z()))];
  }

 private:
  /// Index of the voxel at this place; any place outside is at the rim, which is far from all.
  int index(float x, float y, float z) const {
    const auto clamped = [](float v, float top) {
      v = v < 0.0F ? 0.0F : v;  // not std::clamp: this becomes two vector instructions
      return static_cast<int>(v > top ? top : v);
    };
    return clamped(x, top_[0]) + size_[0] * (clamped(y, top_[1]) + size_[1] * clamped(z, top_[2]));
  }
  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float cell_ = 1;
  std::array<int, 3> size_{1, 1, 1};
  std::array<float, 3> top_{};
  std::vector<std::uint8_t> values_{std::uint8_t{most}};
};

}  // namespace berth::estimator
