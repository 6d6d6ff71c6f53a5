// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <vector>

#include "common/core/table.h"
#include "common/core/text.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

std::string limit(double value) { return std::isinf(value) ? "" : shown(value); }

std::string phase_text(const PhaseTable& phase) {
  char head[160];
  std::snprintf(head, sizeof head, "%s: %.1f s, %lld good estimates, %.2f Hz, tracking %.1f %%\n",
                phase.phase.c_str(), phase.duration_s, static_cast<long long>(phase.estimates),
                phase.update_rate_hz, 100 * phase.tracking_share);
  // Without an estimate there is nothing to compare; the JSON has the rest.
  if (phase.estimates == 0) return head;
  Table table{"ll", {"", "unit", "samples", "mean", "rms", "p95", "peak", "+-"}};
  for (const SeriesRow& row : phase.rows) {
    const Measurement& m = *row.measurement;
    if (m.detail) continue;
    table.rows.push_back({m.name, m.unit, std::to_string(row.samples), shown(row.mean),
                          shown(row.rms), shown(row.p95), shown(row.peak), shown(row.uncertainty)});
  }
  for (const NumberRow& row : phase.numbers) {
    const Measurement& m = *row.measurement;
    if (m.detail || m.name == "duration" || m.name == "estimates") continue;
    table.rows.push_back({m.name, m.unit, std::to_string(row.samples), shown(row.value), "", "", "",
                          shown(row.uncertainty)});
  }
  return head + text_table(table);
}

}  // namespace

std::string verdict_table(const std::vector<criterion_result_t>& criteria) {
  // the subject is the last column: a narrow terminal cuts it off
  Table table{"llrrrrrrl",
              {"result", "criterion", "value", "unit", "+-", "min", "max", "margin", "of"}};
  std::string reasons;
  for (const criterion_result_t& c : criteria) {
    const double m = margin(c);
    table.rows.push_back({words::of_criterion(c.result), c.name, shown(c.value), c.unit,
                          std::isnan(c.value) ? "" : shown(c.uncertainty), limit(c.lower_limit),
                          limit(c.upper_limit), std::isnan(m) ? "" : shown(m),
                          c.measurement + ", " + c.phase});
    if (!c.reason.empty()) reasons += "note: criterion '" + c.name + "': " + c.reason + "\n";
  }
  return text_table(table) + reasons;
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
    if (phase.phase != teardown_phase) text += phase_text(phase) + "\n";
  }
  if (!comparison.latencies.empty()) text += latency_table(comparison.latencies) + "\n";
  return text;
}

std::string verdict_text(const Comparison& comparison) {
  std::string text;
  if (!comparison.criteria.empty()) text += verdict_table(comparison.criteria) + "\n";
  for (const std::string& remark : comparison.remarks) text += "note: " + remark + "\n";
  return text + verdict_line(comparison) + "\n";
}

}  // namespace berth::evaluation
