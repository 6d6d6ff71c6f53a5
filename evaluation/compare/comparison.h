// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/latency/latencies.h"
#include "evaluation/measure/figure.h"
#include "evaluation/run/run_record.h"

namespace berth::evaluation {

/// Statistics of one measurement over a phase, in the measurement's shown unit; p50 to peak of the
/// magnitude.
struct SeriesRow {
  const Measurement* measurement = nullptr;
  std::size_t samples = 0;
  double mean = 0;
  double rms = 0;
  double p50 = 0;
  double p90 = 0;
  double p95 = 0;
  double p99 = 0;
  double peak = 0;
  double uncertainty = 0;  ///< truth's own, of the rms
};

/// A measurement that is one number over a phase, in its shown unit.
struct NumberRow {
  const Measurement* measurement = nullptr;
  std::int64_t samples = 0;
  double value = 0;
  double uncertainty = 0;
  std::string reason;  ///< what else is to be known about it
};

struct PhaseTable {
  std::string phase;
  double duration_s = 0;
  std::int64_t estimates = 0;  ///< with status OK
  double update_rate_hz = 0;
  double tracking_share = 0;
  std::vector<SeriesRow> rows;     ///< only where there were samples
  std::vector<NumberRow> numbers;  ///< only those that could be measured
};

/// Results of a run, recomputed from the messages of its log alone.
struct Comparison {
  std::string log;
  LogSummary summary;
  std::optional<run_info_t> info;
  std::string procedure;
  double duration_s = 0;                ///< from the engine's start to its last word
  std::vector<procedure_step_t> steps;  ///< teardown last
  std::vector<PhaseTable> phases;
  std::vector<TruthBasis> truth_bases;  ///< what truth rests on
  double truth_position_sigma = 0;      ///< m, its median over the run, of the three axes together
  double truth_attitude_sigma = 0;      ///< rad
  std::vector<Latency> latencies;       ///< between LIDAR, arms and host; only of a whole log
  std::vector<criterion_result_t> criteria;
  std::string source;               ///< of the procedure's claims and figures
  std::vector<std::string> claims;  ///< per criterion, the claim of the source; empty: none
  std::vector<Figure> figures;
  /// From the criteria, unless the run itself ended in ERROR, TIMEOUT, ABORTED or FAIL.
  std::int8_t outcome = procedure_state_t::NONE;
  std::string reason;
  /// As the engine gave it at the end of the run; NONE when the log ends before that.
  std::int8_t recorded_outcome = procedure_state_t::NONE;
  std::vector<criterion_result_t> recorded_criteria;
  /// The log reproduces every number of the recorded verdict, bit for bit.
  bool agrees = false;
  std::vector<std::string> remarks;
};

/// A log read once: source of all tables and charts of its run.
struct ComparedRun {
  RunRecord record;
  NearestPoint nearest;  ///< empty where the target's mesh is not at hand
  Comparison comparison;
};

/// Reads a log in one pass and judges each run in it by its own criteria over its own time, by
/// their starts. The visitor sees every message, as in read_runs.
/// @throws InputError when the file cannot be read or holds no run.
std::vector<ComparedRun> compare_runs(const std::filesystem::path& log,
                                      const LogVisitor& visitor = {});
/// The newest of them.
ComparedRun compare_run(const std::filesystem::path& log, const LogVisitor& visitor = {});
Comparison compare_log(const std::filesystem::path& log);
/// @param directory of the log: contains a procedure that was too long for a message
Comparison compare_record(const RunRecord& record, const NearestPoint& nearest,
                          const std::filesystem::path& directory = {});

/// Whether two lists of results are the same, NaN equal to NaN.
bool same_results(const std::vector<criterion_result_t>& a,
                  const std::vector<criterion_result_t>& b);

/// Duration, estimates, update rate and share of tracking of a phase.
std::string heading_of(const PhaseTable& phase);
/// Identity of the run, in a line or two, and the basis of truth.
std::string heading_of(const Comparison& comparison);
/// Every measurement of every phase, and the latencies, as tables.
std::string measurements_text(const Comparison& comparison);
/// The verdict for people: the criteria as a table, missing or odd data, the outcome. Content of
/// verdict.txt, also shown at the end of a run.
std::string verdict_text(const Comparison& comparison);
/// "calibration from scans 3f2a9c01, 0.31 mm and 0.012 deg (1 sigma)"; empty where there is none.
std::string truth_line(const Comparison& comparison);
std::string json_of(const Comparison& comparison);

/// Result, value, limits and margin of each criterion. @param claims of each, where there are any
Table criteria_table(const std::vector<criterion_result_t>& criteria,
                     const std::vector<std::string>& claims = {});
/// State, duration and detail of each step, which is named with its number.
Table steps_table(const std::vector<procedure_step_t>& steps);
/// Measurements of a phase but those of detail, for people.
Table phase_table(const PhaseTable& phase);
/// The verdict in one line, and whether the log reproduces the recorded one.
std::string verdict_line(const Comparison& comparison);

}  // namespace berth::evaluation
