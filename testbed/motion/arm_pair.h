// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "common/core/cell.h"

namespace berth::testbed {

/// The joints of both arms at one time.
struct ArmPair {
  Joints replica{};
  Joints sensor{};

  Joints& of(ArmRole role) { return role == ArmRole::replica ? replica : sensor; }
  const Joints& of(ArmRole role) const { return role == ArmRole::replica ? replica : sensor; }
};

inline constexpr ArmRole both_arms[] = {ArmRole::replica, ArmRole::sensor};

/// a + s * (b - a), joint by joint.
inline ArmPair blend(const ArmPair& a, const ArmPair& b, double s) {
  ArmPair pair;
  for (std::size_t i = 0; i < 6; ++i) {
    pair.replica[i] = a.replica[i] + s * (b.replica[i] - a.replica[i]);
    pair.sensor[i] = a.sensor[i] + s * (b.sensor[i] - a.sensor[i]);
  }
  return pair;
}

/// Largest change of any joint, rad or m.
inline double max_change(const ArmPair& a, const ArmPair& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    largest = std::max(
        {largest, std::abs(a.replica[i] - b.replica[i]), std::abs(a.sensor[i] - b.sensor[i])});
  }
  return largest;
}

/// For messages: "the replica arm".
inline std::string arm_name(ArmRole role) { return std::string("the ") + name_of(role) + " arm"; }

/// Joints at which both arms would come to rest if they were stopped now: they go on at the speed
/// that took them from `before` to `now` (dt, s) for a reaction time (s), and brake with each
/// joint's acceleration.
inline ArmPair stopping_place(const Cell& cell, const ArmPair& before, const ArmPair& now,
                              double dt, double reaction) {
  ArmPair place = now;
  for (const ArmRole role : both_arms) {
    const auto& limits = cell.arm(role).kinematics->limits();
    for (std::size_t i = 0; i < 6; ++i) {
      const double speed = (now.of(role)[i] - before.of(role)[i]) / dt;
      place.of(role)[i] +=
          speed * reaction + speed * std::abs(speed) / (2 * limits[i].acceleration);
    }
  }
  return place;
}

}  // namespace berth::testbed
