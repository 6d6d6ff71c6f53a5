// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace berth::testbed {

/// How a closed loop flies: a file of config/guidance. Lengths and times are those of the cell, but
/// for the orbit's and the vehicle's own. SI units.
struct GuidanceProfile {
  enum class Law { kinematic, clohessy_wiltshire };
  /// docking_axis: in front of the docking interface, wherever it turns; line_of_sight: on a line
  /// that does not turn, looking at the target.
  enum class Align { docking_axis, line_of_sight };
  enum class Bar { v_bar, r_bar };

  /// The orbital flight that the cell represents.
  struct Orbit {
    double mean_motion = 0;   ///< rad/s
    Bar bar = Bar::v_bar;     ///< that the boresight lies along as the flight begins
    double length_scale = 1;  ///< m of orbit per m of the cell
    double time_scale = 1;    ///< s of orbit per s of the cell
  };
  struct Vehicle {
    double mass = 0;              ///< kg
    double thrust = 0;            ///< N, greatest of each body axis, either way
    double specific_impulse = 0;  ///< s
    double shortest_burn = 0;     ///< s at full thrust: the least impulse of an axis, over thrust
  };
  /// Half width at a range: radius + range * tan(half_angle).
  struct Corridor {
    double radius = 0.05;
    double half_angle = 0.17;
  };
  struct HoldPoint {
    double range = 0;
    double dwell = 0;  ///< s without a break within the conditions of proceeding
  };
  /// Conditions of motion along the corridor.
  struct GoOn {
    double offset = 0.05;  ///< m from the axis
    double angle = 0.05;   ///< rad from the reference attitude
    double patience = 60;  ///< s at a hold point without it: then retreat
  };
  struct Final {
    double range = 0.5;   ///< within which
    double speed = 0.01;  ///< m/s is the greatest: the speed at contact
  };
  struct Abort {
    double after = 5;             ///< s without a usable estimate; in the final range at once
    double retreat_range = 5;     ///< at which a retreat ends
    double retreat_speed = 0.05;  ///< m/s, least, away from the target
    double retreat_time = 60;     ///< s after which a retreat ends
  };
  /// Response of the chaser's control.
  struct Tracking {
    double response = 2.5;  ///< s to 1/e of an offset
    double speed = 0.3;     ///< m/s, greatest against the reference motion
  };

  std::string name;  ///< of the file, without its ending
  Law law = Law::kinematic;
  Align align = Align::docking_axis;
  Orbit orbit;      ///< clohessy_wiltshire
  Vehicle vehicle;  ///< clohessy_wiltshire
  Corridor corridor;
  std::vector<HoldPoint> hold_points;  ///< far to near
  GoOn go_on;
  Final final;
  Abort abort;
  Tracking tracking;
};

const char* name_of(GuidanceProfile::Law law);

/// @throws InputError.
GuidanceProfile load_guidance_profile(const std::filesystem::path& file);

}  // namespace berth::testbed
