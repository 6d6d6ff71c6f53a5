// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/comparison.h"

#include <cmath>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/statistics.h"
#include "evaluation/latency/latency_collector.h"
#include "evaluation/run/target_surface.h"

namespace berth::evaluation {
namespace {

SeriesRow row_of(const Measurement& measurement, const Series& series) {
  const auto shown = [&](Statistic s) { return measurement.shown(compute(s, series.value)); };
  SeriesRow row;
  row.measurement = &measurement;
  row.samples = series.value.size();
  row.mean = shown(Statistic::mean);
  row.rms = shown(Statistic::rms);
  row.p50 = shown(Statistic::p50);
  row.p90 = shown(Statistic::p90);
  row.p95 = shown(Statistic::p95);
  row.p99 = shown(Statistic::p99);
  row.peak = shown(Statistic::peak);
  row.uncertainty =
      measurement.shown(uncertainty(Statistic::rms, series.value, series.truth_sigma));
  return row;
}

PhaseTable table_of(const Phase& phase, const Measurer& measurer) {
  PhaseTable table;
  table.phase = phase.name;
  table.duration_s = phase.duration_s();
  for (const Measurement& measurement : measurements()) {
    if (measurement.series) {
      const Series series = measurement.series(measurer, phase);
      if (!series.value.empty()) table.rows.push_back(row_of(measurement, series));
      continue;
    }
    const Measured measured = measurement.number(measurer, phase);
    if (measurement.name == "update_rate") {
      table.update_rate_hz = measured.value;
      table.estimates = measured.samples;
    } else if (measurement.name == "tracking_share") {
      table.tracking_share = measured.value;
    }
    if (std::isnan(measured.value)) continue;
    table.numbers.push_back({&measurement, measured.samples, measurement.shown(measured.value),
                             measurement.shown(measured.uncertainty), measured.reason});
  }
  return table;
}

bool same_number(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// The text of the procedure as it was run: from the run's own messages, or, where it was too long
/// for one, from the file next to the log, if that is the same. Empty: neither.
std::string procedure_text(const run_info_t& info, const std::filesystem::path& directory) {
  const std::filesystem::path file = directory / "procedure.yaml";
  for (const attachment_t& attachment : info.attachments) {
    if (attachment.name != "procedure.yaml") continue;
    if (!attachment.content.empty()) return attachment.content;
    if (std::filesystem::exists(file) && sha256_of_file(file) == attachment.sha256) {
      return read_file(file);
    }
  }
  return {};
}

void take_recorded_verdict(const RunRecord& record, Comparison& comparison) {
  if (!record.state()) {
    comparison.remarks.push_back("the log holds no PROCEDURE_STATE: nothing was run");
    return;
  }
  const procedure_state_t& state = *record.state();
  comparison.procedure = state.procedure;
  comparison.steps = state.steps;
  comparison.duration_s = seconds(state.utime - state.utime_start);
  if (state.state != procedure_state_t::FINISHED) {
    comparison.remarks.push_back("the log ends before the procedure did");
    return;
  }
  comparison.recorded_outcome = state.outcome;
  comparison.recorded_criteria = state.criteria;
  comparison.reason = state.reason;
}

/// Whether the criteria decide: the engine judged by them, went on after a failed one or not, or
/// every step up to the teardown was passed or skipped when the log ends.
bool criteria_decide(const procedure_state_t& state) {
  if (state.state == procedure_state_t::FINISHED) {
    switch (state.outcome) {
      case procedure_state_t::PASS:
      case procedure_state_t::INCONCLUSIVE:
        return true;
      case procedure_state_t::FAIL:
        if (state.reason.empty()) return true;  // of a step, a limit or a lost target otherwise
        break;
      case procedure_state_t::ERROR:
        return false;  // the rig's; a teardown that failed, too
      default:
        break;
    }
  }
  for (const procedure_step_t& step : state.steps) {
    if (step.phase == teardown_phase) continue;
    if (step.state != procedure_step_t::PASSED && step.state != procedure_step_t::SKIPPED) {
      return false;
    }
  }
  return true;
}

/// @param judged by the criteria
void decide(const RunRecord& record, std::int8_t judged, Comparison& comparison) {
  if (!record.state()) return;
  const bool finished = record.state()->state == procedure_state_t::FINISHED;
  const std::int8_t recorded = comparison.recorded_outcome;
  if (criteria_decide(*record.state())) {
    comparison.outcome = judged;
  } else {
    comparison.outcome = finished ? recorded : static_cast<std::int8_t>(procedure_state_t::ERROR);
  }
  comparison.agrees = finished && comparison.outcome == recorded &&
                      same_results(comparison.criteria, comparison.recorded_criteria);
}

}  // namespace

bool same_results(const std::vector<criterion_result_t>& a,
                  const std::vector<criterion_result_t>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].name != b[i].name || a[i].result != b[i].result || a[i].samples != b[i].samples ||
        !same_number(a[i].value, b[i].value) || !same_number(a[i].uncertainty, b[i].uncertainty) ||
        a[i].lower_limit != b[i].lower_limit || a[i].upper_limit != b[i].upper_limit) {
      return false;
    }
  }
  return true;
}

namespace {

void describe_truth(const RunRecord& record, Comparison& comparison) {
  comparison.truth_bases = record.truth_bases();
  std::vector<double> position;
  std::vector<double> attitude;
  for (const TruthSample& sample : record.truth().samples()) {
    position.push_back(std::sqrt(sample.covariance.topLeftCorner<3, 3>().trace()));
    attitude.push_back(std::sqrt(sample.covariance.bottomRightCorner<3, 3>().trace()));
  }
  if (position.empty()) return;
  comparison.truth_position_sigma = median(position);
  comparison.truth_attitude_sigma = median(attitude);
}

/// By the procedure in the log. @throws InputError where that is not there, or is not understood.
void judge_criteria(const Measurer& measurer, const std::filesystem::path& directory,
                    Comparison& comparison) {
  const run_info_t* info = measurer.record().info();
  const std::string text = info ? procedure_text(*info, directory) : "";
  if (text.empty()) throw InputError("the log does not hold the procedure");
  Config procedure = Config::parse(text, "procedure.yaml in the log");
  const std::vector<Criterion> criteria = read_criteria(procedure);
  comparison.criteria = judge(criteria, measurer);
  for (const Criterion& criterion : criteria) comparison.claims.push_back(criterion.claim);
  try {
    procedure.optional("source", comparison.source);
    comparison.figures = read_figures(procedure, criteria);
  } catch (const std::exception& e) {
    comparison.remarks.push_back(std::string("the figures cannot be drawn: ") + e.what());
  }
}

}  // namespace

Comparison compare_record(const RunRecord& record, const NearestPoint& nearest,
                          const std::filesystem::path& directory) {
  Comparison comparison;
  describe_truth(record, comparison);
  if (record.info()) comparison.info = *record.info();
  take_recorded_verdict(record, comparison);
  const Measurer measurer(record, nearest);
  for (const Phase& phase : record.phases()) {
    comparison.phases.push_back(table_of(phase, measurer));
  }
  std::int8_t judged = procedure_state_t::INCONCLUSIVE;
  try {
    judge_criteria(measurer, directory, comparison);
    judged = outcome_of(comparison.criteria);
  } catch (const std::exception& e) {
    comparison.criteria.clear();
    comparison.remarks.push_back(std::string("the criteria cannot be judged: ") + e.what());
  }
  decide(record, judged, comparison);
  return comparison;
}

namespace {

ComparedRun judged(RunRecord record, const LogSummary& summary, const LatencyCollector& latencies,
                   const std::filesystem::path& log) {
  ComparedRun run;
  run.record = std::move(record);
  std::string why;
  const run_info_t* info = run.record.info();
  if (info != nullptr) run.nearest = nearest_point_of_run(*info, log.parent_path(), why);
  Comparison& comparison = run.comparison;
  comparison = compare_record(run.record, run.nearest, log.parent_path());
  try {
    comparison.latencies = latencies.latencies(Measurer(run.record, run.nearest));
  } catch (const std::exception& e) {
    comparison.remarks.push_back(std::string("the latencies cannot be estimated: ") + e.what());
  }
  comparison.log = log.string();
  comparison.summary = summary;
  if (!why.empty()) comparison.remarks.push_back(why);
  std::string no_symmetry;
  if (info != nullptr) symmetry_of_run(*info, &no_symmetry);
  if (!no_symmetry.empty()) comparison.remarks.push_back(no_symmetry);
  if (summary.damaged_bytes != 0) {
    comparison.remarks.push_back(std::to_string(summary.damaged_bytes) +
                                 " bytes of the log are damaged and were passed over");
  }
  if (summary.missing_events != 0) {
    comparison.remarks.push_back(std::to_string(summary.missing_events) +
                                 " events are missing from the log");
  }
  if (summary.undecodable != 0) {
    comparison.remarks.push_back(std::to_string(summary.undecodable) +
                                 " messages could not be decoded");
  }
  return run;
}

}  // namespace

std::vector<ComparedRun> compare_runs(const std::filesystem::path& log, const LogVisitor& visitor) {
  LogSummary summary;
  LatencyCollector latencies;
  std::vector<RunRecord> records =
      read_runs(log, summary, std::nullopt, [&](const logs::LogEvent& event) {
        latencies.take(event);
        if (visitor) visitor(event);
      });
  if (records.empty()) {
    throw InputError(log.string() + ": holds no run: neither RUN_INFO nor PROCEDURE_STATE in " +
                     std::to_string(summary.events) + " events");
  }
  std::vector<ComparedRun> runs;
  for (RunRecord& record : records) {
    runs.push_back(judged(std::move(record), summary, latencies, log));
  }
  return runs;
}

ComparedRun compare_run(const std::filesystem::path& log, const LogVisitor& visitor) {
  return std::move(compare_runs(log, visitor).back());
}

Comparison compare_log(const std::filesystem::path& log) { return compare_run(log).comparison; }

}  // namespace berth::evaluation
