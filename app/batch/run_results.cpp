// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/run_results.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "evaluation/compare/change.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/run/outcome.h"

namespace berth {
namespace {

using evaluation::Statistic;

constexpr Statistic recorded[] = {Statistic::rms, Statistic::mean, Statistic::p95, Statistic::peak};

void add_phase(const evaluation::Measurer& measurer, const evaluation::Phase& phase,
               std::vector<RunValue>& values) {
  for (const evaluation::Measurement& what : evaluation::measurements()) {
    const auto add = [&](const std::string& statistic, double si, std::int64_t samples) {
      if (!std::isfinite(si)) return;
      values.push_back({phase.name, what.name, statistic, what.unit, what.shown(si), samples});
    };
    if (what.number) {
      const evaluation::Measured measured = what.number(measurer, phase);
      add("value", measured.value, measured.samples);
      continue;
    }
    const evaluation::Series series = what.series(measurer, phase);
    if (series.value.empty()) continue;
    for (const Statistic statistic : recorded) {
      add(evaluation::name_of(statistic), evaluation::compute(statistic, series.value),
          static_cast<std::int64_t>(series.value.size()));
    }
  }
}

std::string failed_criteria(const std::vector<criterion_result_t>& criteria) {
  std::string text;
  for (const criterion_result_t& c : criteria) {
    if (c.result != criterion_result_t::FAILED && c.result != criterion_result_t::INCONCLUSIVE) {
      continue;
    }
    text += (text.empty() ? "" : "; ") + c.name + ": " +
            (c.reason.empty() ? shown(c.value) + " " + c.unit : c.reason);
  }
  return text;
}

}  // namespace

std::vector<RunValue> values_of(const evaluation::ComparedRun& run) {
  std::vector<RunValue> values;
  const evaluation::Comparison& comparison = run.comparison;
  const bool passed = comparison.outcome == procedure_state_t::PASS;
  const bool completed = comparison.recorded_outcome != procedure_state_t::NONE &&
                         std::none_of(comparison.steps.begin(), comparison.steps.end(), went_wrong);
  values.push_back(
      {evaluation::whole_run, evaluation::passed_measurement, "value", "", passed ? 1.0 : 0.0, 1});
  values.push_back({evaluation::whole_run, evaluation::completed_measurement, "value", "",
                    completed ? 1.0 : 0.0, 1});
  const evaluation::Measurer measurer(run.record, run.nearest);
  for (const evaluation::Phase& phase : run.record.phases()) add_phase(measurer, phase, values);
  for (const criterion_result_t& c : comparison.criteria) {
    if (!std::isfinite(c.value)) continue;
    // "rms position_error": the statistic is implied, the criterion's name distinguishes it.
    const std::string measurement = c.measurement.substr(c.measurement.rfind(' ') + 1);
    values.push_back({c.phase, measurement, c.name, c.unit, c.value, c.samples});
  }
  return values;
}

void take_results(const evaluation::ComparedRun& compared, FinishedRun& run) {
  const evaluation::Comparison& comparison = compared.comparison;
  if (comparison.info) {
    run.configuration_hash = comparison.info->configuration_hash;
    run.version = comparison.info->version;
  }
  run.simulated_s = comparison.duration_s;
  run.values = values_of(compared);
  run.outcome = outcome_of_run(comparison.outcome);
  run.error = comparison.reason;
  if (run.error.empty() && !run.passed()) run.error = failed_criteria(comparison.criteria);
}

void read_results(const std::filesystem::path& directory, int exit_code, FinishedRun& run) {
  try {
    const evaluation::ComparedRun compared = evaluation::compare_run(directory / "run.lcm");
    take_results(compared, run);
    const bool died = exit_code >= 128;
    if (!died && compared.comparison.recorded_outcome != procedure_state_t::NONE) return;
    run.outcome = Outcome::error;
    run.error =
        died ? "its process died of signal " + std::to_string(exit_code - 128)
             : "its log ends before its verdict (exit code " + std::to_string(exit_code) + ")";
  } catch (const std::exception& e) {
    run.outcome = Outcome::error;
    run.error = e.what();
  }
}

}  // namespace berth
