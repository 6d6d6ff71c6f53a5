// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/scan_window_t.hpp>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "common/core/pose.h"
#include "logs/measure/criterion.h"
#include "procedures/language/parameters.h"

namespace berth::procedures {

/// The verbs of the language. Lengths in m, angles in rad, times in s; poses are T_sensor_model.

/// Sets the lamps; done when the facility reports them so.
struct Lights {
  double sun = 0;     ///< 0..1
  double albedo = 0;  ///< 0..1
  double sun_azimuth = 0;
  double sun_elevation = 0;
};

/// Straight to a relative pose, open loop.
struct Move {
  Pose to;
  double speed = 0;
  double angular_speed = 0;
};

/// Through waypoints at their times, open loop.
struct Trajectory {
  struct Waypoint {
    double at = 0;
    Pose pose;
  };
  std::vector<Waypoint> waypoints;
};

/// Looks for the target; done with the first good estimate.
struct Acquire {
  double gate_near = 0;  ///< 0, 0: the estimator's own
  double gate_far = 0;
  int returns = 0;  ///< 0: the estimator's own choice
};

/// Tracks on from the current pose; done after `settle` good estimates in a row.
struct Track {
  double gate_near = 0;  ///< m; 0, 0: the estimator's own
  double gate_far = 0;
  std::string strategy;  ///< empty: the estimator's own
  int returns = 0;
  int settle = 3;
};

/// Closed loop, by the estimate alone, until the nearest surface is this far from the sensor.
struct Approach {
  double standoff = 0;
  double speed = 0;
  bool dock = false;  ///< the docking interface on the boresight, at the standoff
};

/// Stays where it is while tracking goes on; closed loop: steers to keep the relative pose.
struct Hold {
  double duration = 0;
  bool closed_loop = false;
};

struct Wait {
  double duration = 0;
};

/// One scan of the procedure's own.
struct Scan {
  scan_window_t window{};
};

/// Leaves a remark in the log.
struct Annotate {
  std::string text;
};

/// The estimator asks for no more scans.
struct StopTracking {};

using Verb = std::variant<Lights, Move, Trajectory, Acquire, Track, Approach, Hold, Wait, Scan,
                          Annotate, StopTracking>;

struct Step {
  Verb verb;
  std::string name;    ///< for a person; the verb's own unless given
  std::string phase;   ///< label under which its stretch of time is judged; the verb unless given
  double timeout = 0;  ///< s
  int line = 0;
};

/// A test script as it will run.
struct Procedure {
  std::string file;
  std::string text;  ///< with all parameters filled in
  std::string name;
  std::string description;
  std::string layout;        ///< empty: the operator's choice
  std::string target;        ///< empty: the operator's choice
  double target_length = 0;  ///< m; 0: as it is
  double lost_for =
      15;  ///< s without a good estimate, while tracking, after which the run has failed
  std::vector<Step> steps;
  std::vector<Step> teardown;  ///< always run
  std::vector<logs::Criterion> criteria;
};

/// Reads and checks a procedure: syntax, names, units, phases, parameters.
/// @throws InputError "file:line: key ...: found ..., expected ...".
Procedure load_procedure(const std::filesystem::path& file, const Overrides& overrides = {});
Procedure parse_procedure(const std::string& text, const std::string& file,
                          const Overrides& overrides = {});

}  // namespace berth::procedures
