// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/model/lanes.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Where faces end that stand some centimetres before others (StandingBorders), as seen from one
/// place.
class Foreground {
 public:
  /// eye: model frame, m.
  Foreground(const TargetModel& model, const Vector3d& eye);

  /// Whether one ends nearer than this to the line of sight to a point of a triangle, m at the
  /// point.
  bool near(std::uint32_t triangle, const Vector3d& point, double reach) const {
    const std::uint32_t first = first_[triangle];
    const std::uint32_t last = first_[triangle + 1];
    if (first == last) return false;
    const Vector3d sight = point - eye_;
    const Four3 d{four(sight.x()), four(sight.y()), four(sight.z())};
    const Four most = four(reach);
    auto found = most < most;
    for (std::uint32_t i = first; i < last; ++i) {
      const Screen& screen = screens_[i];
      const Four beside = screen.across.dot(d);
      found |= (beside < most) & (beside > -most) & (screen.from.dot(d) > -most) &
               (screen.to.dot(d) > -most);
    }
    return (found[0] | found[1] | found[2] | found[3]) != 0;
  }

 private:
  /// Normals of planes through the eye, of four ends: one that holds it, two where it begins and
  /// stops.
  struct Screen {
    Four3 across, from, to;
  };

  Vector3d eye_;
  std::vector<std::uint32_t> first_;  // of each triangle
  std::vector<Screen> screens_;
};

}  // namespace berth::estimator
