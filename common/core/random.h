// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

#include "common/core/pose.h"

namespace berth {

/// A reproducible random stream (xoshiro256++). The same (seed, name) gives the same numbers on
/// every machine; streams of different names are independent. The standard library's distributions
/// are not used because their results differ between implementations.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view name);

  std::uint64_t bits();
  /// In [0, 1).
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal, by the polar method.
  double normal();
  double normal(double sigma) { return sigma * normal(); }
  Vector3d normal_vector(double sigma) { return {normal(sigma), normal(sigma), normal(sigma)}; }
  /// Uniform over all attitudes.
  Quaterniond rotation();

 private:
  std::uint64_t state_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace berth
