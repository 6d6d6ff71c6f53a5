// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "common/core/pose.h"
#include "common/core/random.h"

namespace berth {

/// A smooth random field: three components that are independent of each other, each a Gaussian
/// process of unit variance with the covariance exp(-d^2 / 2 l^2), by random Fourier features
/// [Rahimi and Recht, NIPS 2007].
class SmoothField {
 public:
  /// @param length l, m
  SmoothField(Random random, double length);

  /// @param x m
  Vector3d at(const Vector3d& x) const;

 private:
  static constexpr int count = 200;
  struct Feature {
    Vector3d frequency;
    double phase = 0;
    Vector3d amplitude;
  };
  std::array<Feature, count> features_;
};

}  // namespace berth
