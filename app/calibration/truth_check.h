// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace berth {

/// How far a simulated run's ground truth is from its world.
struct TruthCheck {
  std::string basis;
  std::int64_t samples = 0;    ///< slower than 50 mm/s
  double median_position = 0;  ///< m
  double worst_position = 0;   ///< m, 95 %
  double median_rotation = 0;  ///< rad
  double worst_rotation = 0;
  double time = 0;  ///< s by which truth's stamps are too early, from all its motion
};

/// Compares GROUND_TRUTH in the run's log with world_truth.lcm in the same directory.
/// @throws InputError when one of them is missing or empty.
TruthCheck check_truth(const std::filesystem::path& run);

}  // namespace berth
