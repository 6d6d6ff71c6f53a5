// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/node_status_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/scan_request_t.hpp>
#include <map>
#include <string>
#include <vector>

#include "logs/file/log_event.h"

namespace berth::report {

/// What a report shows of one POSE_ESTIMATE beside what judging needs of it.
struct EstimateDetail {
  Utime utime = 0;
  std::int64_t scan_id = 0;
  std::int8_t status = pose_estimate_t::IDLE;
  std::string reason;
  int returns_used = 0;
  int returns_received = 0;
  int misses = 0;
};

/// How long the estimator worked at one estimate, s.
struct WorkTimes {
  Utime utime = 0;
  double preprocess = 0;
  double acquire = 0;
  double track = 0;
  double plan = 0;
  double total() const { return preprocess + acquire + track + plan; }
};

/// A node as its NODE_STATUS tells over a run.
struct NodeHealth {
  struct Change {
    Utime utime = 0;
    std::int8_t state = node_status_t::STARTING;
    std::string reason;
  };
  std::vector<Change> changes;  ///< of state or reason, in order of time
  node_status_t last{};
  Utime max_silence = 0;  ///< between two messages
};

/// What a report shows of a log and that is not in its RunRecord.
struct RunDetails {
  std::vector<EstimateDetail> estimates;  ///< in the log's order
  std::vector<WorkTimes> work_times;
  std::map<std::string, NodeHealth> nodes;
  std::map<std::int64_t, scan_request_t> scans;  ///< by scan_id

  /// Forgets estimates and work times of other times: the log holds other runs of the session.
  void keep(Utime from, Utime to);
};

/// Collects the details of every session in a log while it is read. Keeps no beam: the few scans
/// that are drawn are read again, by read_beams, once they are chosen.
class DetailsCollector {
 public:
  void take(const logs::LogEvent& event);
  /// Those of one session; empty when the log has none.
  RunDetails details_of(std::int64_t session) const;

 private:
  std::map<std::int64_t, RunDetails> sessions_;
};

}  // namespace berth::report
