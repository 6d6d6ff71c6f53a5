// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

namespace berth::estimator {

/// The directions that a beam may have had for its angle noise: as reported, and sqrt(3) standard
/// deviations to the sides. Weighted so, they have the moments of the normal distribution up to the
/// fifth (Gauss-Hermite, three by three).
struct BeamNodes {
  static constexpr std::size_t count = 9;
  static constexpr std::array<double, count> weight = {4 / 9.,  1 / 9.,  1 / 9.,  1 / 9., 1 / 9.,
                                                       1 / 36., 1 / 36., 1 / 36., 1 / 36.};
  static constexpr std::array<double, count> right = {0, 1, -1, 0, 0, 1, 1, -1, -1};
  static constexpr std::array<double, count> up = {0, 0, 0, 1, -1, 1, -1, 1, -1};
};

}  // namespace berth::estimator
