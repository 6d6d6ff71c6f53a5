// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/core/pose.h"

namespace berth::testbed {

/// An estimate as guidance uses it.
struct Estimate {
  std::int64_t utime = 0;
  Pose pose;                   ///< T_sensor_model
  bool usable = false;         ///< status OK
  std::string status;          ///< why not, for the operator
  bool attitude_known = true;  ///< well enough for steering
  /// Of the model, sensor frame; none where its covariance is unknown.
  std::optional<Velocity> velocity = std::nullopt;
  std::int64_t dead_time = 0;  ///< us from a command to its motion, nominal or measured

  /// Time of the command that was executed at utime.
  std::int64_t commanded() const { return utime - dead_time; }
};

/// State of a closed loop, for GUIDANCE_STATE (guidance_state_t has the meanings).
struct GuidanceReport {
  enum class Phase {
    inactive,
    approaching,
    at_hold_point,
    final,
    contact,
    station_keeping,
    holding,
    retreating,
    guided
  };
  std::string profile;
  std::string law;
  Phase phase = Phase::inactive;
  std::string reason;
  double length_scale = 1;
  double time_scale = 1;
  double orbit_time = 0;
  double range = -1;  ///< m; negative: not known
  double closing_speed = 0;
  double reference_closing_speed = 0;
  double corridor_offset = 0;
  double corridor_limit = -1;
  double misalignment = 0;
  int hold_point = -1;
  Vector3d acceleration_orbit = Vector3d::Zero();
  double delta_v_orbit = 0;
  double propellant = 0;
};

/// Steers the chaser in closed loop, by the estimates alone. Commands the pose of the
/// target in the sensor frame as it would be had the target not moved by itself since the start.
class Steering {
 public:
  enum class Phase {
    flying,
    holding,  ///< for the reason given; goes on by itself
    done,
    aborted  ///< for the reason given, and back from the target
  };
  struct Output {
    Pose commanded;
    Phase phase = Phase::flying;
    std::string reason;
    double progress = 0;  ///< 0..1
  };

  virtual ~Steering() = default;
  virtual void on_estimate(const Estimate&) {}
  /// now: us; dt: seconds of flight since the last step, 0 while time stands still.
  virtual Output step(std::int64_t now, double dt) = 0;
  virtual GuidanceReport report() const = 0;
  virtual double remaining() const { return 0; }  ///< s, as forecast
};

}  // namespace berth::testbed
