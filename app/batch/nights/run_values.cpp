// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/run_values.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "common/core/text.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/run/outcome.h"
#include "lcmtypes/words.h"

namespace berth::nights {
namespace {

using evaluation::Statistic;

constexpr Statistic recorded[] = {Statistic::rms, Statistic::mean, Statistic::p95, Statistic::peak};

bool went_wrong(const procedure_step_t& step) {
  switch (step.state) {
    case procedure_step_t::FAILED:
    case procedure_step_t::ERROR:
    case procedure_step_t::TIMEOUT:
    case procedure_step_t::ABORTED:
      return true;
    default:
      return false;
  }
}

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
    // "rms position_error": the statistic goes without saying, the criterion's name tells it apart.
    const std::string measurement = c.measurement.substr(c.measurement.rfind(' ') + 1);
    values.push_back({c.phase, measurement, c.name, c.unit, c.value, c.samples});
  }
  return values;
}

void read_results(const std::filesystem::path& directory, int exit_code, FinishedRun& run) {
  run.outcome = "ERROR";
  try {
    const evaluation::ComparedRun compared = evaluation::compare_run(directory / "run.lcm");
    const evaluation::Comparison& comparison = compared.comparison;
    if (comparison.info) {
      run.configuration_hash = comparison.info->configuration_hash;
      run.version = comparison.info->version;
    }
    run.simulated_s = comparison.duration_s;
    run.values = values_of(compared);
    if (exit_code >= 128) {
      run.reason = "its process died of signal " + std::to_string(exit_code - 128);
    } else if (comparison.recorded_outcome == procedure_state_t::NONE) {
      run.reason = "its log ends before its verdict (exit code " + std::to_string(exit_code) + ")";
    } else {
      run.outcome = words::of_outcome(comparison.outcome);
      run.reason = comparison.reason;
      if (run.reason.empty() && !run.passed()) run.reason = failed_criteria(comparison.criteria);
    }
  } catch (const std::exception& e) {
    run.reason = e.what();
  }
}

}  // namespace berth::nights
