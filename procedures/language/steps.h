// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/lidar_profile.h"
#include "common/core/pose.h"
#include "procedures/language/condition.h"
#include "procedures/language/trajectory.h"

namespace berth::procedures {

/// The verbs of the language. Lengths in m, angles in rad, times in s; poses are T_sensor_model.

/// Sets the lamps; done when the facility reports the requested levels and direction.
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
  int frozen_arm = 0;  ///< as in testbed_command2_t: 0 none, 1 replica, 2 sensor
};

/// Back along the path of the last motion, to its begin.
struct Retreat {
  double speed = 0;  ///< 0: the testbed's own
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
  std::optional<Pose> from;  ///< expected pose of the target; nothing: the last estimate
};

/// How a closed loop flies, and what the target does meanwhile.
struct ClosedLoop {
  std::string guidance;                     ///< of config/guidance; empty: the testbed's own
  std::optional<Trajectory> target_motion;  ///< in the frame the model has at the start
};

/// Closed loop, by the estimate alone, until the nearest surface is this far from the sensor.
struct Approach {
  double standoff = 0;
  double speed = 0;
  /// The docking port to bring onto the boresight, at the standoff; empty: the target's first.
  /// Nothing: the standoff is of the nearest surface.
  std::optional<std::string> port = std::nullopt;
  ClosedLoop loop = {};
};

/// Rests while tracking goes on; closed loop: steers to keep the relative pose.
struct Hold {
  double duration = 0;
  bool closed_loop = false;
  ClosedLoop loop = {};
};

/// Closed loop, by an outside GNC's set-points.
struct Guided {
  std::string by;  ///< its name as commander
  double duration = 0;
  double speed = 0;
  double angular_speed = 0;
  std::optional<Condition> until;  ///< done earlier
  std::optional<Trajectory> target_motion;
};

struct Wait {
  double duration = 0;
};

/// Until a condition is met.
struct WaitUntil {
  Condition condition;
};

/// Until so many good estimates of a target at rest have come; `calibrate` is made of these.
struct Dwell {
  int estimates = 0;
  double settle = 0;  ///< s after the motion before the first scan counts
};

/// One scan of the procedure's own.
struct Scan {
  Window window;
};

/// A question to the operator.
struct Prompt {
  std::string text;
  std::vector<std::string> choices;  ///< none: any text
  std::vector<std::string> go_on;    ///< answers with which the step has passed; none: all
  std::string default_value;         ///< the answer when none comes in time; empty: none
};

/// Leaves a remark in the log.
struct Annotate {
  std::string text;
};

/// Leaves the present value of a live quantity in the log.
struct Record {
  std::string name;
  const LiveQuantity* quantity = nullptr;
};

/// A fault requested of the simulated cell.
struct Inject {
  std::string device;
  std::string fault;
  double value = 0;     ///< SI; its quantity depends on the fault
  double duration = 0;  ///< s; 0: until cleared
  double after = 0;     ///< s; 0: now, and the step waits until the fault is active
};

/// Ends a fault; with neither device nor fault all of them.
struct ClearInjections {
  std::string device;
  std::string fault;
};

/// The estimator requests no more scans.
struct StopTracking {};

using Verb = std::variant<Lights, Move, Retreat, Trajectory, Acquire, Track, Approach, Hold, Guided,
                          Wait, WaitUntil, Dwell, Scan, Prompt, Annotate, Record, Inject,
                          ClearInjections, StopTracking>;

/// Reaction to a step that fails, times out or has an error.
struct OnFailure {
  enum class Then { abort, go_on, hold };
  int retries = 0;  ///< number of retries before
  Then then = Then::abort;
};

/// Reaction to a target lost (`lost_for`) while a step runs.
enum class WhenLost { fail, skip, ignore };

/// A condition on this step and those that follow it in the same block.
struct Gate {
  Condition condition;
  int steps = 1;  ///< how many are skipped when it is not met
};

struct Step {
  Verb verb;
  std::string name;    ///< for the operator; default: the verb's
  std::string phase;   ///< label of its time interval for criteria; default: the verb
  double timeout = 0;  ///< s
  OnFailure on_failure = {};
  WhenLost when_lost = WhenLost::fail;
  std::vector<Gate> gates = {};  ///< evaluated in this order when the step is due
  int depth = 0;                 ///< in repeats, sweeps and called procedures
  std::string file = {};         ///< of the procedure that contains it
  int line = 0;                  ///< in that file
};

}  // namespace berth::procedures
