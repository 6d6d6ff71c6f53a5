// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "evaluation/latency/arm_tracks.h"
#include "evaluation/latency/latencies.h"
#include "evaluation/measure/measurer.h"
#include "logs/file/log_event.h"

namespace berth::evaluation {

/// Collects from a log what its latencies are estimated from beside a run's record: both arms'
/// set-points and readings, and the clocks. Of every session, for which of them the run is may be
/// known only at its end.
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
