// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <deque>

#include "common/bus/loop.h"

namespace berth {

/// Motion of the program `LBL[1]; J PR[1] 100% CNTn; JMP LBL[1]`, in motor coordinates.
///
/// The line reads PR[1] when the previous motion admits the next one, on the interpolation grid,
/// and plans from the last target to PR[1]: a trapezoid of speed that ends at rest, all motors in
/// proportion, the slowest at its limits. Nothing beyond that point is known (no look-ahead). The
/// next motion begins in the last n % of the time in which this one slows down, and the two are
/// added (blending): with CNT100 evenly spaced points are passed without a stop, as fast as the
/// acceleration allows for their distance, at whatever rate the host sends them. The robot is then
/// early and waits for the next point: its speed is uneven.
class PositionRegisterLoop {
 public:
  using Motors = Eigen::Matrix<double, 6, 1>;
  struct Limits {
    Motors speed;  ///< rad/s or m/s, override included; 0: no motion begins
    Motors acceleration;
  };

  /// @param cnt of the motion's termination, 0..100
  explicit PositionRegisterLoop(int cnt) : cnt_(cnt) {}

  /// The program starts at the robot's present joints, which are PR[1] until it is written.
  void start(const Motors& here, Utime now);
  /// PR[1] as the program reads it from `visible` on.
  void write(const Motors& target, Utime visible) { writes_.push_back({visible, target}); }
  /// Where the robot is at `now`, which is the start of an interpolation period.
  void advance(Utime now, const Limits& limits);
  Motors position(Utime t) const;

 private:
  struct Write {
    Utime visible;
    Motors target;
  };
  /// A trapezoid over way() of 1: rises, goes on, slows down.
  struct Motion {
    Utime begin;
    Motors way;
    double ramp = 0;   // s, up and down
    double total = 0;  // s

    double share(Utime t) const;
    bool over(Utime t) const { return seconds(t - begin) >= total; }
  };

  int cnt_;
  std::deque<Write> writes_;
  Motors read_ = Motors::Zero();    // PR[1]
  Motors rest_ = Motors::Zero();    // where motions that are over have led
  Motors target_ = Motors::Zero();  // of the last motion
  std::deque<Motion> motions_;      // one, or two that blend
};

}  // namespace berth
