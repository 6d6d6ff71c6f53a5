// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/bus/loop.h"
#include "common/core/arm_kinematics.h"

namespace berth {

/// State of a controller, as reported.
enum class ControllerState { idle = 1, running = 2, held = 3, fault = 4, emergency_stop = 5 };

/// One report of a controller.
struct ArmReport {
  bool valid = false;  ///< the controller marks the joints as valid
  Joints joints{};     ///< rad, m
  /// m, where the controller has its flange in its World; none: of another tool, or not known.
  std::optional<Vector3d> flange{};
  /// us, on the controller's clock: the interpolation period of the joints.
  Utime controller_time = 0;
  int heartbeat = 0;
  int setpoint_taken = 0;  ///< ArmOrder::sequence of the last set-point that it has taken
  int state = 0;           ///< a ControllerState
  int error = 0;
  std::string alarm{};        ///< the controller's text for the error, once it is read
  int program_state = 0;      ///< 0 aborted, 1 paused, 2 running
  double speed_override = 0;  ///< 0..1
  double tcp_speed = 0;       ///< m/s
  Utime sent = 0;             ///< host time, us: the report is later
  Utime received = 0;         ///< host time, us: the report is earlier
};

/// Set-point of a controller.
struct ArmOrder {
  Joints joints{};         ///< rad, m
  int sequence = 0;        ///< the controller takes the joints when it changes
  bool follow = false;     ///< false: stop
  double speed_limit = 1;  ///< 0..1 of the joints' own
  Utime time = 0;          ///< host time at which the joints should be reached, us
};

/// An arm's controller as the driver's node uses it, of any protocol. It keeps its connections up
/// by itself. Driven by a loop; never waits. The node calls poll() and send() at their periods; a
/// controller that reports by itself, or requests its set-points, does not need the call.
class ArmAdapter {
 public:
  struct Capabilities {
    Utime clock_resolution = 0;   ///< us, of ArmReport::controller_time
    int sequence_wrap = 1 << 24;  ///< sequences are below it
  };
  enum class Change {
    connected,
    ready,         ///< it reports from now on
    not_verified,  ///< before ready; the text names the part of its setup that could not be checked
    wrong,         ///< it is set up otherwise than configured; reported repeatedly
    lost,          ///< it no longer reports or cannot be reached; the text gives the reason
    setpoints_open,   ///< set-points come through
    setpoints_closed  ///< they do not; the text gives the reason
  };
  struct Events {
    std::function<void(Change, const std::string& text)> changed;
    std::function<void(const ArmReport&)> report;
    /// A poll without a report. refused: by the controller; the connection stays open.
    std::function<void(const std::string& error, bool refused)> missed;
  };
  /// error is empty when the controller has acknowledged the request.
  using Done = std::function<void(const std::string& error)>;

  virtual ~ArmAdapter() = default;

  /// Call once, first.
  virtual void start(Events events) = 0;
  /// For messages: "127.0.0.1:15021".
  virtual const std::string& name() const = 0;
  virtual const Capabilities& capabilities() const = 0;

  virtual bool ready() const = 0;
  /// Some way to the controller is open: a hold can be tried.
  virtual bool reachable() const = 0;
  virtual bool takes_setpoints() const = 0;
  /// A set-point is under way.
  virtual bool busy() const = 0;

  /// Requests a report; followed by one call of report or missed.
  virtual void poll() = 0;
  /// Sends the newest set-point and the host's heartbeat.
  virtual void send(const ArmOrder& order, Done done) = 0;
  /// Stops the arm, ahead of all else, over each connection that may be needed. @return how often
  /// done will be called.
  virtual int hold(Done done) = 0;
  /// Ends the signal of hold(), before a start.
  virtual void release() = 0;
  virtual void run() = 0;    ///< the program that follows set-points
  virtual void reset() = 0;  ///< the controller's faults
};

}  // namespace berth
