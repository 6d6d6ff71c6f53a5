// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_diagnostics_t.hpp>
#include <berth/event_t.hpp>
#include <berth/ground_truth_t.hpp>
#include <berth/injection_state_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <berth/run_info_t.hpp>
#include <berth/setpoint_latency_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <berth/verdict_basis_t.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "evaluation/run/truth_track.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_event.h"

namespace berth::evaluation {

/// The fields of one POSE_ESTIMATE that judging needs.
struct EstimateSample {
  Utime utime = 0;
  std::int64_t seq = 0;
  std::int8_t status = pose_estimate_t::IDLE;
  Pose pose;                               ///< T_sensor_model, filtered
  Matrix6d covariance = Matrix6d::Zero();  ///< [m; rad], sensor frame
  Velocity velocity;                       ///< sensor frame
  Pose measured;                           ///< by this scan alone
  std::int64_t scan_id = 0;
  std::int32_t first_packet = 0;  ///< of the scan that the estimate rests on
  std::int32_t last_packet = 0;
  std::int32_t returns_used = 0;

  bool ok() const { return status == pose_estimate_t::OK; }
};

EstimateSample sample_of(const pose_estimate_t& message);

/// The commanded relative pose of the arms, in nominal kinematics.
struct CommandedSample {
  Utime utime = 0;  ///< of the command; the arms reach it a dead time later
  std::int64_t seq = 0;
  Pose pose;                 ///< T_sensor_model
  bool by_estimate = false;  ///< guidance goes after the estimates
};

/// Latency of one estimate, as the estimator reports it.
struct LatencySample {
  Utime utime = 0;  ///< of the estimate
  std::int64_t seq = 0;
  Utime latency = 0;  ///< from the last return of its scan to when it was published
};

/// Nothing for a message without it.
std::optional<Utime> latency_in(const estimator_diagnostics_t& message);

/// The first return of a beam of SCAN_DATA, seen from the sensor's origin.
struct ScanReturn {
  Utime utime = 0;
  float range = 0;      ///< m
  float azimuth = 0;    ///< rad
  float elevation = 0;  ///< rad
};

/// Basis of truth.
struct TruthBasis {
  std::string basis;  ///< nominal, scans, tracker ...
  std::string calibration_hash;

  friend bool operator<(const TruthBasis& a, const TruthBasis& b) {
    return std::tie(a.basis, a.calibration_hash) < std::tie(b.basis, b.calibration_hash);
  }
};

/// A stretch of time under one label: all steps of the procedure that carry it.
struct Phase {
  struct Stretch {
    Utime start = 0;
    Utime end = 0;
  };
  std::string name;
  std::vector<Stretch> stretches;  ///< in order of time

  bool contains(Utime utime) const;
  Utime start() const { return stretches.front().start; }
  Utime end() const { return stretches.back().end; }
  double duration_s() const;
};

/// All messages of one session that a verdict rests on. The engine fills it from the bus as the run
/// goes, compare from the log: the result does not depend on the order of arrival across channels,
/// nor on repeats. A cell that is up takes one procedure after another in one session: state(),
/// info() and the phases are those of the newest; runs() has one record of each.
class RunRecord {
 public:
  void add(const pose_estimate_t& message);
  void add(const ground_truth_t& message);
  /// Keeps nothing of one without latency_us.
  void add(const estimator_diagnostics_t& message);
  void add(const procedure_state_t& message);
  void add(const run_info_t& message);
  void add(const event_t& message);
  void add(const setpoint_latency_t& message);
  void add(const injection_t& message);
  void add(const injection_state_t& message);
  void add(const verdict_basis_t& message);
  void add(const testbed_state_t& message);
  /// Keeps which docking port an approach was for.
  void add(const testbed_command2_t& message);
  /// Keeps an even sample of its returns, enough to measure their scatter.
  void add(const ScanPacket& message);

  /// Of the messages so far; without utime, seq and session.
  verdict_basis_t basis() const;
  /// Removes what came after the run was judged, where the log holds that time.
  void keep_judged();
  /// A record of each procedure, by their starts: of several each has the messages of its own time
  /// only. This record itself where there is none, or one.
  std::vector<RunRecord> runs() &&;

  const std::vector<EstimateSample>& estimates() const { return estimates_; }
  const std::vector<LatencySample>& latencies() const { return latencies_; }
  const std::vector<CommandedSample>& commanded() const { return commanded_; }
  /// Those kept of the packets that an estimate rests on, in their order.
  std::vector<ScanReturn> returns_of(const EstimateSample& estimate) const;
  const TruthTrack& truth() const { return truth_; }
  /// Bases of truth; more than one where the calibration changed within a session.
  std::vector<TruthBasis> truth_bases() const;
  /// The docking port that the last approach begun until then was for; empty: the target's first.
  std::string docking_port(Utime until) const;
  /// Whether guidance went after the estimates at that time.
  bool steered(Utime utime) const;
  const std::vector<event_t>& events() const { return events_; }
  /// When the simulated cell began to carry out each fault that was injected.
  std::vector<Utime> fault_times() const;
  const std::vector<setpoint_latency_t>& setpoint_latencies() const { return setpoint_latencies_; }
  /// The newest; null when there was none. Good until the next message is added.
  const procedure_state_t* state() const;
  /// The first of the same procedure; null when there was none.
  const run_info_t* info() const;

  /// The phases in the order in which they began, steps that never ran left out; then "run", the
  /// whole of the procedure without its teardown.
  std::vector<Phase> phases() const;
  std::optional<Phase> phase(const std::string& name) const;

 private:
  std::vector<EstimateSample> estimates_;
  std::vector<LatencySample> latencies_;
  std::vector<CommandedSample> commanded_;
  std::map<Utime, std::string> docking_ports_;  // by the time of the command
  std::map<std::pair<std::int64_t, std::int32_t>, std::vector<ScanReturn>>
      returns_;  // scan, packet
  TruthTrack truth_;
  RunRecord run(const procedure_state_t& state) const;

  std::map<TruthBasis, Phase::Stretch> truth_bases_;  // from its first sample to its last
  std::vector<event_t> events_;
  std::vector<setpoint_latency_t> setpoint_latencies_;
  std::vector<verdict_basis_t> bases_;
  std::set<std::int64_t> injected_;                       // seq of each INJECT
  std::map<std::int64_t, Utime> injections_carried_out_;  // by seq
  std::map<Utime, procedure_state_t> states_;  // of each procedure the newest, by its start
  std::map<std::string, run_info_t> infos_;    // of each run the first, by its name
};

/// Event that holds the verdict's basis, as text, in logs written before VERDICT_BASIS.
inline constexpr char judged_event_code[] = "judged";

/// Name of the phase under which the teardown's steps run.
inline constexpr char teardown_phase[] = "teardown";
/// Name of the phase from the first step to the last one before the teardown.
inline constexpr char whole_run[] = "run";

/// "cell", "simulated cell" or "twin".
const char* text_of_host(std::int8_t host);

/// The world (config/worlds) by which a simulated cell departs from its files, e.g. "lab", by the
/// configuration in RUN_INFO. Empty: of a cell, or where that names none.
std::string world_of(const run_info_t& info);

/// Where a run was: "cell", "twin in lab".
std::string place_of(const run_info_t& info);

/// State of a log as a file.
struct LogSummary {
  std::int64_t events = 0;
  std::int64_t missing_events = 0;
  std::size_t damaged_bytes = 0;
  std::int64_t undecodable = 0;    ///< of the channels looked at
  std::int64_t other_session = 0;  ///< of sessions without a procedure
  Utime first = 0;
  Utime last = 0;
};

/// Sees every message of a log, of all sessions, in the log's order; the event is good during the
/// call.
using LogVisitor = std::function<void(const logs::LogEvent&)>;

/// The runs in a log, by their starts: of each session that has any a record of each procedure. One
/// pass over the log: a visitor receives the messages that the records do not keep.
/// @param session only that one @throws InputError when the file cannot be read.
std::vector<RunRecord> read_runs(const std::filesystem::path& log, LogSummary& summary,
                                 std::optional<std::int64_t> session = std::nullopt,
                                 const LogVisitor& visitor = {});
/// The newest of them; an empty record when there is none.
RunRecord read_run(const std::filesystem::path& log, LogSummary& summary,
                   std::optional<std::int64_t> session = std::nullopt,
                   const LogVisitor& visitor = {});

}  // namespace berth::evaluation
