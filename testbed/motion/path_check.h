// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "testbed/motion/arm_pair.h"
#include "testbed/motion/clearance.h"

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

/// The joint with the largest excess over its limit.
struct RateExcess {
  double time = 0;
  ArmPair joints;
  std::string text;         ///< arm, joint, required rate and limit
  double passing_rate = 1;  ///< of the speed planned, at which it would be within its limit
};

/// Compares speed, acceleration and jerk of every joint, and of the motor of J3, with its limits,
/// and the acceleration that a hold needs: every motion must be able to stop on its path. samples:
/// close enough for differences, their times increasing. @return the worst, if any is beyond its
/// limit.
std::optional<RateExcess> excess_of(const Cell& cell, const std::vector<PathSample>& samples,
                                    const RateLimits& limits);

/// A motion of both arms over its own time, from rest to rest.
class ArmMotion {
 public:
  virtual ~ArmMotion() = default;
  /// s.
  virtual double duration() const = 0;
  /// Joints t seconds after the start; near: the joints just before. Nothing when it is infeasible.
  virtual std::optional<ArmPair> at(double t, const ArmPair& near, std::string* reason) const = 0;
};

struct PathLimits {
  RateLimits rates;
  double manipulability = 0.02;    ///< least; 0 at a singularity
  double largest_step = 0.2;       ///< rad between samples; more is a change of branch
  double sample_time = 0.1;        ///< s
  double clearance_step = 0.03;    ///< m, slack requested of one evaluation
  double clearance_blind = 0.005;  ///< m that bodies may approach each other between evaluations
};

/// Why a motion must not start.
struct Refusal {
  std::string text;         ///< where, when and which limit
  double time = 0;          ///< s after the start
  double passing_rate = 0;  ///< of the requested speed, at which it would pass; 0: at none
};

/// Checks a whole motion before it starts: joint limits including the coupled joint, singularities,
/// changes of branch, clearance between all bodies and keep-outs, and speed, acceleration and jerk
/// of the motors, also of a hold at any time. A motion that cannot finish, or cannot stop on its
/// path, does not start.
class PathCheck {
 public:
  PathCheck(const Cell& cell, const PathLimits& limits, Clearance& clearance)
      : cell_(cell), limits_(limits), clearance_(clearance) {}

  /// Nothing when the motion is good.
  std::optional<Refusal> check(const ArmMotion& motion, const ArmPair& start) const;
  /// The same for one instant, without speed: for steering, whose path is unknown beforehand.
  std::optional<std::string> check(const ArmPair& joints) const;

  const PathLimits& limits() const { return limits_; }

 private:
  using Path = std::vector<PathSample>;

  std::optional<Refusal> sample(const ArmMotion& motion, const ArmPair& start, Path& path) const;
  std::optional<Refusal> sample_to(const ArmMotion& motion, double t, int halvings,
                                   Path& path) const;
  std::optional<Refusal> check_singularities(const Path& path) const;
  std::optional<Refusal> check_clearance(const Path& path) const;
  /// Checks between two samples; slack: of the first one, m.
  std::optional<Refusal> check_between(const PathSample& a, const PathSample& b,
                                       double& spare) const;
  std::optional<Refusal> check_clearance_at(const PathSample& sample, double& spare) const;
  std::string place(double t, const ArmPair& joints) const;
  std::optional<std::string> check_joints(const ArmPair& joints) const;
  std::optional<std::string> check_singularity(const ArmPair& joints, double& value) const;

  const Cell& cell_;
  PathLimits limits_;
  Clearance& clearance_;
};

}  // namespace berth::testbed
