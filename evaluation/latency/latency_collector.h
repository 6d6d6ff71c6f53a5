// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <map>
#include <optional>
#include <vector>

#include "evaluation/latency/delay_fit.h"
#include "evaluation/latency/latencies.h"
#include "evaluation/measure/measurer.h"
#include "logs/file/log_event.h"

namespace berth::evaluation {

/// One arm over a run: set-points and reported joints.
class ArmTrack {
 public:
  void add(const arm_command_t& command);
  void add(const arm_state_t& state);

  /// Delay of the arm's reported position against its set-points' times. A constant difference does
  /// not count.
  DelayFit following_delay() const;

  struct Clock {
    Utime utime = 0;
    double offset = 0;  ///< controller minus host, s
    double sigma = 0;
  };
  const std::vector<Clock>& clocks() const { return clocks_; }
  /// s from the request of each reading to its answer.
  const std::vector<double>& round_trips() const { return round_trips_; }

 private:
  struct Point {
    Utime utime = 0;
    Vector6d joints;
  };
  struct Reading {
    Point at;
    Vector6d information;
  };
  std::optional<Vector6d> commanded(Utime utime) const;
  std::vector<DelaySample> samples(double delay) const;

  std::vector<Point> commands_;
  std::vector<Reading> readings_;
  std::vector<Clock> clocks_;
  std::vector<double> round_trips_;
};

/// Collects from a log the data for its latencies that a run's record does not hold: both arms'
/// set-points and readings, and the clocks. Of every session, because that of the run may be known
/// only at its end.
class LatencyCollector {
 public:
  void take(const logs::LogEvent& event);

  /// Between LIDAR, arms and host, over the whole run; those of which the log has no data are left
  /// out.
  std::vector<Latency> latencies(const Measurer& measurer) const;

 private:
  struct Session {
    ArmTrack replica;
    ArmTrack sensor;
    std::vector<ArmTrack::Clock> lidar;
  };
  std::map<std::int64_t, Session> sessions_;
};

}  // namespace berth::evaluation
