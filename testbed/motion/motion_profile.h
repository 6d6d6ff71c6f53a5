// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace berth::testbed {

/// Travel from rest to rest along one coordinate. Speed rises and falls as a cubic of time, so that
/// acceleration is continuous and neither it nor jerk exceeds its limit.
class SmoothTravel {
 public:
  SmoothTravel() = default;
  /// length, speed, acceleration and jerk in one unit of length and s; all positive, length >= 0.
  SmoothTravel(double length, double speed, double acceleration, double jerk);

  double duration() const { return 2 * ramp_ + cruise_; }
  double length() const { return length_; }
  /// Clamped to 0 .. length outside the duration.
  double position(double t) const;
  double speed(double t) const;

 private:
  double rise(double t) const;  // distance covered t into the first ramp

  double length_ = 0;
  double peak_ = 0;
  double ramp_ = 0;    // s
  double cruise_ = 0;  // s
};

/// How fast time runs along a motion: 1 as planned, 0 at rest. Changes are smooth, so that hold,
/// resume and speed override bring both arms to another speed on the path, and never off it.
class TimeScale {
 public:
  /// settling: s within which a change is over.
  explicit TimeScale(double settling);
  /// 1/s: a hold lets the rate fall as (1 + f t) exp(-f t).
  static double frequency(double settling);

  void set_target(double rate) { target_ = rate; }
  double target() const { return target_; }
  double rate() const { return rate_; }
  bool at_rest() const { return rate_ == 0; }
  /// Stops at once: the arms were stopped by their controllers.
  void stop();
  /// Time that passes along the motion in dt seconds.
  double advance(double dt);

 private:
  double frequency_;
  double target_ = 0;
  double rate_ = 0;
  double slope_ = 0;
};

}  // namespace berth::testbed
