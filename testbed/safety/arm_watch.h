// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "testbed/motion/arm_pair.h"
#include "testbed/motion/command_history.h"

namespace berth::testbed {

/// A report or an estimate that is physically impossible.
struct Contradiction {
  std::string code;  ///< stable name, for events
  std::string text;  ///< for the operator
};

/// Plausibility of one controller's reports, sample by sample: no joint is faster than its motor's
/// limit, and the clock does not step back unless the controller was restarted.
class ReportWatch {
 public:
  struct Report {
    std::int64_t utime = 0;            ///< us, time of the joints
    std::int64_t controller_time = 0;  ///< us, the controller's own clock, unwrapped
    Joints joints{};
    Joints sigma{};  ///< 1 sigma of each
  };

  ReportWatch(std::string name, const ArmKinematics& arm) : name_(std::move(name)), arm_(arm) {}

  /// Valid reports only, in their order.
  std::optional<Contradiction> check(const Report& report);

 private:
  std::string name_;
  const ArmKinematics& arm_;
  std::optional<Report> last_;
};

/// Whether one arm follows its commands: the joints reported now are those commanded a dead time
/// ago. The dead time includes the lag of the reports and differs between controllers; it is
/// identified from the arm's motion, unknown when the controllers are started, and common to all
/// six joints. An arm whose joints agree with no plausible dead time does not follow.
///
/// A delay is plausible while the residual that it leaves,
///   J(delay) = integral of the sum over joints of ((reported - commanded a delay before) /
///   limit)^2,
/// is not significantly above that of the best one: following errors of a tenth of the limit that
/// last for a second do not determine the delay.
///
/// A delay may change: a controller under load, another route of the network. A second J covers the
/// last second (exponential weights, time at rest included). Once the overall best delay is
/// significantly worse in it than its own best one, older data are dropped. So a delay that changes
/// over seconds, or at rest, is followed; a step during a motion is not: for about a second the arm
/// then counts as not following.
class FollowingWatch {
 public:
  struct Settings {
    double largest_lag = 0.0175;          ///< rad, reported joint from the commanded one
    double largest_linear_lag = 0.05;     ///< m, of a linear axis
    std::int64_t max_dead_time = 500000;  ///< us from a set-point to where its motion is reported
  };
  /// From a set-point to the motion that is reported for it, us.
  struct DeadTime {
    std::int64_t best = 0;
    std::int64_t min = 0;  ///< plausible
    std::int64_t max = 0;
  };

  FollowingWatch(ArmRole role, const ArmKinematics& arm, const Settings& settings);

  /// The controllers are started: the history of commands begins anew.
  void begin();
  /// Valid joints at t, us, whose time is known to time_sigma, s; commands: of both arms.
  /// @return how the arm deviates.
  std::optional<Contradiction> check(std::int64_t t, double time_sigma, const Joints& reported,
                                     const JointHistory& commands);
  /// Identified from the arm's motion; at first any value up to the maximum.
  const DeadTime& dead_time() const { return dead_time_; }

 private:
  double limit(std::size_t joint) const;
  std::int64_t beyond(std::size_t best) const;
  void learn(std::int64_t t, const Joints& reported, const JointHistory& commands);

  ArmRole role_;
  const ArmKinematics& arm_;
  Settings settings_;
  std::vector<double> residual_;  // J of each delay, s
  std::vector<double> recent_;    // of the last second
  DeadTime dead_time_;
  std::int64_t learned_ = 0;  // when last; 0: not yet
};

}  // namespace berth::testbed
