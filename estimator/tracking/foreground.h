// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <immintrin.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Where faces end that stand some centimetres before others (StandingBorders), as seen from one
/// place.
class Foreground {
 public:
  /// eye: model frame, m.
  Foreground(const TargetModel& model, const Vector3d& eye);

  const Vector3d& eye() const { return eye_; }

  /// Whether one ends nearer than this to the line of sight to a point of a triangle, m at the
  /// point.
  bool near(std::uint32_t triangle, const Vector3d& point, double reach) const {
    const std::uint32_t first = first_[triangle];
    const std::uint32_t last = first_[triangle + 1];
    if (first == last) return false;
    const Eigen::Vector3f sight = (point - eye_).cast<float>();
    const Lanes x = lanes(sight.x());
    const Lanes y = lanes(sight.y());
    const Lanes z = lanes(sight.z());
    const Lanes most = lanes(static_cast<float>(reach));
    auto found = most < most;
    for (std::uint32_t i = first; i < last; ++i) {
      const Screen& screen = screens_[i];
      const auto along = [&](const std::array<Lanes, 3>& normal) {
        return normal[0] * x + normal[1] * y + normal[2] * z;
      };
      const Lanes beside = along(screen.across);
      found |= (beside < most) & (beside > -most) & (along(screen.from) > -most) &
               (along(screen.to) > -most);
    }
    const auto bits = reinterpret_cast<__m256i>(found);
    return _mm256_testz_si256(bits, bits) == 0;
  }

 private:
  /// Single precision: at 10 m a micrometre.
  static constexpr std::size_t width = 8;
  using Lanes = float __attribute__((vector_size(4 * width)));
  static Lanes lanes(float v) { return Lanes{v, v, v, v, v, v, v, v}; }

  /// Normals of planes through the eye, of some ends: one that holds it, two where it begins and
  /// stops.
  struct Screen {
    std::array<Lanes, 3> across, from, to;
  };

  Vector3d eye_;
  std::vector<std::uint32_t> first_;  // of each triangle
  std::vector<Screen> screens_;
};

}  // namespace berth::estimator
