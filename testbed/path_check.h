// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "testbed/clearance.h"

namespace berth::testbed {

/// A motion of both arms over its own time, from rest to rest.
class ArmMotion {
 public:
  virtual ~ArmMotion() = default;
  /// s.
  virtual double duration() const = 0;
  /// Joints t seconds after the start; near: the joints just before. Nothing when an arm cannot.
  virtual std::optional<ArmPair> at(double t, const ArmPair& near, std::string* reason) const = 0;
};

struct PathLimits {
  double speed = 0.8;            ///< of each joint's own
  double acceleration = 0.8;     ///< of each joint's own
  double manipulability = 0.02;  ///< least; 0 at a singularity
  double largest_step = 0.2;     ///< rad of a joint between two samples: more is a change of branch
  double sample_time = 0.1;      ///< s
  double clearance_step = 0.03;  ///< m that bodies may move between two looks at their distance
};

/// Why a motion must not start.
struct Refusal {
  std::string text;         ///< where, when and which limit
  double time = 0;          ///< s after the start
  double passing_rate = 0;  ///< of the speed asked for, at which it would pass; 0: at none
};

/// Looks at a whole motion before it starts: joints with the coupled one, motor speeds and
/// accelerations, singularities, changes of branch, and clearance between all bodies. Nothing
/// starts that cannot finish.
class PathCheck {
 public:
  PathCheck(const Cell& cell, const PathLimits& limits, Clearance& clearance)
      : cell_(cell), limits_(limits), clearance_(clearance) {}

  /// Nothing when the motion is good.
  std::optional<Refusal> check(const ArmMotion& motion, const ArmPair& start) const;
  /// The same for one instant, without speed: for steering that is not known beforehand.
  std::optional<std::string> check(const ArmPair& joints) const;

 private:
  struct Rates;
  std::string place(double t, const ArmPair& joints) const;
  std::optional<std::string> check_joints(const ArmPair& joints) const;
  std::optional<std::string> check_singularity(const ArmPair& joints) const;

  const Cell& cell_;
  PathLimits limits_;
  Clearance& clearance_;
};

}  // namespace berth::testbed
