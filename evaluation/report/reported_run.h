// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/node_status_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/scan_request_t.hpp>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "evaluation/compare/comparison.h"
#include "evaluation/report/chart.h"
#include "logs/file/log_event.h"

namespace berth::report {

/// Fields of one POSE_ESTIMATE that a report shows and judging does not need.
struct EstimateDetail {
  Utime utime = 0;
  std::int64_t scan_id = 0;
  std::int8_t status = pose_estimate_t::IDLE;
  std::string reason;
  int returns_used = 0;
  int returns_received = 0;
  int misses = 0;
};

/// Computing time of one estimate, s.
struct WorkTimes {
  Utime utime = 0;
  double preprocess = 0;
  double acquire = 0;
  double track = 0;
  double plan = 0;
  double total() const { return preprocess + acquire + track + plan; }
};

/// Health of a node over a run, from NODE_STATUS.
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

/// Data of a log that a report shows and its RunRecord does not hold.
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

/// A log with all that a report shows of it.
struct ReportedRun {
  std::filesystem::path log;
  std::filesystem::path directory;  ///< of the run; empty where only the log is at hand
  evaluation::ComparedRun run;
  RunDetails details;

  std::string name() const;  ///< of the run, or of its log's file
};

/// Reads and judges a log in one pass: each run in it, by their starts.
/// @param directory of the run; empty: a log alone
/// @throws InputError as compare_runs.
std::vector<ReportedRun> read_reported_runs(const std::filesystem::path& log,
                                            const std::filesystem::path& directory = {});

/// A run made ready for its charts: times count from the run's start.
class RunView {
 public:
  /// The run must outlive it.
  explicit RunView(const ReportedRun& run);

  const ReportedRun& source() const { return source_; }
  const evaluation::RunRecord& record() const { return source_.run.record; }
  const evaluation::Comparison& comparison() const { return source_.run.comparison; }
  const evaluation::Measurer& measurer() const { return measurer_; }
  const RunDetails& details() const { return source_.details; }

  Utime start() const { return start_; }
  double end_s() const { return end_s_; }
  double at(Utime utime) const { return seconds(utime - start_); }
  /// Phases in which the procedure did something, without the whole run and the teardown.
  const std::vector<evaluation::Phase>& phases() const { return phases_; }
  /// Name of the phase at that time; empty between phases.
  std::string phase_at(Utime utime) const;

  /// A chart over the whole run, with its phases, the times without a good estimate, and the events
  /// that are warnings or worse.
  Chart chart(const std::string& title, const std::string& unit) const;

 private:
  const ReportedRun& source_;
  evaluation::Measurer measurer_;
  Utime start_ = 0;
  double end_s_ = 1;
  std::vector<evaluation::Phase> phases_;
  std::vector<Span> spans_;
  std::vector<Mark> marks_;
};

using Views = std::vector<const RunView*>;

}  // namespace berth::report
