// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// Where both arms are at one time of a motion.
struct PathSample {
  double time = 0;  ///< s after its start
  ArmPair joints;
};

/// Parts of the joints' own limits that a motion may use.
struct RateLimits {
  double speed = 0.8;
  double acceleration = 0.8;
  double rise_time = 0.05;     ///< s from no to full acceleration of a joint: the limit of its jerk
  double hold_settling = 0.8;  ///< s within which a hold brings the arms to rest
};

/// The joint that is asked for most, compared with its limit.
struct RateExcess {
  double time = 0;
  ArmPair joints;
  std::string text;         ///< arm, joint, what it would need and its limit
  double passing_rate = 1;  ///< of the speed planned, at which it would be within its limit
};

/// Compares speed, acceleration and jerk of every joint, and of the motor of J3, with its limits,
/// and the acceleration that a hold needs: whatever is started must be able to stop on its path.
/// samples: close enough for differences, their times increasing. @return the worst, if any is
/// beyond its limit.
std::optional<RateExcess> excess_of(const Cell& cell, const std::vector<PathSample>& samples,
                                    const RateLimits& limits);

}  // namespace berth::testbed
