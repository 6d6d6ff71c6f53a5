// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include "common/core/table.h"
#include "common/core/text.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

std::string limit(double value) { return std::isinf(value) ? "" : shown(value); }

Table::Status status_of(const criterion_result_t& c) {
  return c.result == criterion_result_t::PASSED   ? Table::passed
         : c.result == criterion_result_t::FAILED ? Table::failed
                                                  : Table::inconclusive;
}

Table::Status status_of(const procedure_step_t& step) {
  switch (step.state) {
    case procedure_step_t::PASSED:
      return Table::passed;
    case procedure_step_t::PENDING:
    case procedure_step_t::SKIPPED:
      return Table::inconclusive;
    case procedure_step_t::FAILED:
      return Table::failed;
    default:
      return Table::error;
  }
}

}  // namespace

Table phase_table(const PhaseTable& phase) {
  Table table{"ll", {"", "unit", "samples", "mean", "rms", "p95", "peak", "+-"}};
  for (const SeriesRow& row : phase.rows) {
    const Measurement& m = *row.measurement;
    if (m.detail) continue;
    table.rows.push_back({m.name, m.unit, row.samples, shown(row.mean), shown(row.rms),
                          shown(row.p95), shown(row.peak), shown(row.uncertainty)});
  }
  for (const NumberRow& row : phase.numbers) {
    const Measurement& m = *row.measurement;
    if (m.detail || m.name == "duration" || m.name == "estimates") continue;
    table.rows.push_back(
        {m.name, m.unit, row.samples, shown(row.value), "", "", "", shown(row.uncertainty)});
  }
  return table;
}

Table criteria_table(const std::vector<criterion_result_t>& criteria,
                     const std::vector<std::string>& claims) {
  // the subject is the last column shown: a narrow terminal cuts it off
  Table table{"llrrrrrrl",
              {no_json("result"), keyed("criterion", "name"), json_only("measurement"),
               json_only("phase"), json_only("unit"), "value", no_json("unit"),
               keyed("+-", "uncertainty"), "min", "max", "margin", no_json("of"),
               json_only("samples"), json_only("result"), json_only("reason"), json_only("claim")}};
  for (std::size_t i = 0; i < criteria.size(); ++i) {
    const criterion_result_t& c = criteria[i];
    const double m = margin(c);
    const char* result = words::of_criterion(c.result);
    std::vector<Table::Cell> cells = {
        result,
        c.name,
        c.measurement,
        c.phase,
        c.unit,
        valued(shown(c.value), c.value),
        c.unit,
        valued(std::isnan(c.value) ? "" : shown(c.uncertainty), c.uncertainty),
        valued(limit(c.lower_limit), c.lower_limit),
        valued(limit(c.upper_limit), c.upper_limit),
        valued(std::isnan(m) ? "" : shown(m), m),
        c.measurement + ", " + c.phase,
        c.samples,
        result,
        c.reason};
    if (i < claims.size() && !claims[i].empty()) cells.push_back(claims[i]);
    table.rows.push_back({std::move(cells), status_of(c), c.name, c.reason});
  }
  return table;
}

Table steps_table(const std::vector<procedure_step_t>& steps) {
  Table table{"l",
              {no_json("state"), json_only("name"), json_only("phase"), json_only("state"),
               json_only("attempts"), json_only("depth"), "detail", json_only("utime_start"),
               json_only("utime_end")}};
  for (const procedure_step_t& s : steps) {
    const char* state = words::of_step_state(s.state);
    table.rows.push_back(
        {{state, s.name, s.phase, state, s.attempts, s.depth, s.detail, s.utime_start, s.utime_end},
         status_of(s),
         std::to_string(table.rows.size() + 1) + " " + s.name,
         "",
         s.utime_end > s.utime_start ? seconds(s.utime_end - s.utime_start) : 0});
  }
  return table;
}

std::string verdict_line(const Comparison& comparison) {
  std::string text = std::string("verdict: ") + words::of_outcome(comparison.outcome);
  if (!comparison.reason.empty()) text += " (" + comparison.reason + ")";
  if (comparison.recorded_outcome == procedure_state_t::NONE) {
    return text + "; the log holds no verdict of its own";
  }
  text += "; reproduced from the log: ";
  if (comparison.agrees) return text + "identical";
  return text + "DIFFERENT, recorded was " + words::of_outcome(comparison.recorded_outcome);
}

std::string truth_line(const Comparison& comparison) {
  constexpr std::size_t hash_shown = 8;
  std::string text;
  for (const TruthBasis& basis : comparison.truth_bases) {
    text += (text.empty() ? "" : " and ") + (basis.basis.empty() ? "not stated" : basis.basis);
    if (!basis.calibration_hash.empty()) {
      text += " (calibration " + basis.calibration_hash.substr(0, hash_shown) + ")";
    }
  }
  if (text.empty()) return {};
  return text + ", 1 sigma " + shown(1e3 * comparison.truth_position_sigma) + " mm and " +
         shown(degrees(comparison.truth_attitude_sigma)) + " deg";
}

std::string heading_of(const PhaseTable& phase) {
  return phase.phase + ": " + fixed(phase.duration_s, 1) + " s, " +
         std::to_string(phase.estimates) + " good estimates, " + fixed(phase.update_rate_hz, 2) +
         " Hz, tracking " + fixed(100 * phase.tracking_share, 1) + " %";
}

std::string heading_of(const Comparison& comparison) {
  std::string text;
  const LogSummary& log = comparison.summary;
  if (!comparison.log.empty()) {
    text += comparison.log + ": " + std::to_string(log.events) + " events, " +
            shown(seconds(log.last - log.first)) + " s\n";
  }
  if (comparison.info) {
    const run_info_t& info = *comparison.info;
    text += "run " + info.run + ": procedure " + info.procedure + ", layout " + info.layout +
            ", target " + info.target + " (" + shown(info.target_length_m) + " m), host " +
            place_of(info) + ", seed " + std::to_string(info.seed) + ", version " + info.version +
            "\n";
  }
  const std::string truth = truth_line(comparison);
  if (!truth.empty()) text += "truth rests on: " + truth + "\n";
  return text + "\n";
}

std::string measurements_text(const Comparison& comparison) {
  std::string text;
  for (const PhaseTable& phase : comparison.phases) {
    if (phase.phase == teardown_phase) continue;
    text += heading_of(phase) + "\n";
    // Without an estimate there is nothing to compare; the JSON has the rest.
    if (phase.estimates > 0) text += text_table(phase_table(phase));
    text += "\n";
  }
  if (!comparison.latencies.empty()) {
    text += text_table(latency_table(comparison.latencies)) + "\n";
  }
  return text;
}

std::string verdict_text(const Comparison& comparison) {
  std::string text;
  if (!comparison.criteria.empty()) text += text_table(criteria_table(comparison.criteria)) + "\n";
  for (const std::string& remark : comparison.remarks) text += "note: " + remark + "\n";
  return text + verdict_line(comparison) + "\n";
}

}  // namespace berth::evaluation
