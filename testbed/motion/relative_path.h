// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/pose.h"
#include "testbed/motion/motion_profile.h"

namespace berth::testbed {

/// A motion of the replica in the sensor frame over its own time, from rest to rest.
class RelativePath {
 public:
  struct Point {
    Pose pose;            ///< T_sensor_model
    double progress = 0;  ///< 0..1, rising from rest to rest as the pose does
  };
  virtual ~RelativePath() = default;
  /// s.
  virtual double duration() const = 0;
  /// t: s after the start; clamped to the duration.
  virtual Point at(double t) const = 0;
};

/// Greatest rates of relative motion.
struct RelativeLimits {
  double speed = 0.05;                  ///< m/s
  double angular_speed = 0.087;         ///< rad/s
  double acceleration = 0.05;           ///< m/s^2
  double angular_acceleration = 0.087;  ///< rad/s^2
  double rise_time = 0.5;               ///< s from no to full acceleration: the limit of jerk
};

/// Straight from one pose to another, turning about one axis.
class StraightPath final : public RelativePath {
 public:
  StraightPath(const Pose& from, const Pose& to, const RelativeLimits& limits);
  double duration() const override { return travel_.duration(); }
  Point at(double t) const override;

 private:
  Pose from_;
  Vector6d change_;
  SmoothTravel travel_;  // its unit of length: what full speed covers in a second
};

/// Through poses at given times, with continuous velocity and acceleration (quintic between
/// neighbours); at rest in the first and the last by default (see Ends).
class WaypointPath final : public RelativePath {
 public:
  struct Waypoint {
    double time = 0;  ///< s; increasing, the first 0
    Pose pose;
  };
  enum class Ends { at_rest, under_way };
  /// waypoints: at least two. With Ends::under_way it begins and ends with the speed of its first
  /// and last interval; the caller adds ramps.
  explicit WaypointPath(std::vector<Waypoint> waypoints, Ends ends = Ends::at_rest);
  double duration() const override { return waypoints_.back().time; }
  Point at(double t) const override;

 private:
  std::vector<Waypoint> waypoints_;
  struct Rates {
    Velocity velocity;
    Velocity acceleration;
  };
  std::vector<Rates> rates_;  // at the waypoints
};

}  // namespace berth::testbed
