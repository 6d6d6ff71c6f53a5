// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/runner.h"

#include <algorithm>
#include <cmath>

#include "app/attempt.h"
#include "app/batch/pool.h"
#include "app/runs/watched_process.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/text.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/run/outcome.h"

namespace berth::nights {
namespace fs = std::filesystem;
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

bool in_real_time(const PlannedRun& run) { return run.of->host != "twin"; }

std::vector<std::string> command_of(const PlannedRun& run, const RunnerConfiguration& configuration,
                                    const fs::path& out) {
  const bool baseline = run.build == Build::baseline;
  std::vector<std::string> words{"/usr/bin/env"};
  // A build finds its own files; ours must not be taken for those of another.
  if (baseline) words.insert(words.end(), {"-u", "BERTH_HOME"});
  words.push_back(baseline ? configuration.baseline.build.string()
                           : configuration.program.string());
  words.insert(words.end(), {"run", "--seed", std::to_string(run.seed), "--out", out.string()});
  if (run.of->host == "twin") words.push_back("--twin");
  if (run.of->host == "cell") words.push_back("--hardware");
  if (run.of->host == "simulated-cell") {
    words.insert(words.end(), {"--lcm-url", "udpm://239.255.76.67:7711?ttl=0"});
  }
  if (!run.of->target.empty()) words.insert(words.end(), {"--target", run.of->target});
  const fs::path config = baseline ? configuration.baseline.config : run.of->config;
  if (!config.empty()) words.insert(words.end(), {"--config", config.string()});
  // The baseline flies by its own.
  if (!run.of->estimator.empty() && !baseline) {
    words.insert(words.end(), {"--estimator", run.of->estimator.string()});
  }
  for (const auto& [name, value] : run.of->parameters) {
    words.insert(words.end(), {"--set", name + "=" + value});
  }
  words.push_back(run.of->procedure.string());
  return words;
}

std::string procedure_hash(const Case& of) {
  std::string text = read_file(of.procedure);
  for (const auto& [name, value] : of.parameters) text += "\n" + name + "=" + value;
  return sha256(text);
}

/// The run directory that a process made; empty when it made none.
fs::path made_in(const fs::path& out) {
  for (const auto& entry : fs::directory_iterator(out)) {
    if (entry.is_directory()) return entry.path();
  }
  return {};
}

/// Moves a run to where it stays. What is there is of an interrupted night.
void put_in_place(const fs::path& made, const fs::path& place) {
  std::error_code ignored;
  fs::remove_all(place, ignored);
  fs::rename(made.parent_path() / "output.txt", made / "output" / "berth-run.txt", ignored);
  fs::rename(made, place);
}

FinishedRun finished_run(const PlannedRun& run, const RunnerConfiguration& configuration,
                         const fs::path& out, const TaskEnd& end) {
  FinishedRun result;
  result.case_name = run.of->name;
  result.build = run.build;
  result.seed = run.seed;
  result.fresh = run.fresh;
  result.procedure = run.of->procedure.string();
  attempt([&] { result.procedure_hash = procedure_hash(*run.of); });
  result.target = run.of->target;
  result.host = run.of->host;
  result.wall_s = end.wall_s;
  result.cpu_s = end.process.user_s + end.process.system_s;

  const fs::path made = made_in(out);
  if (made.empty()) {
    result.outcome = Outcome::error;
    result.error =
        "it made no run directory (" + end.process.name() + "): " + last_line(out / "output.txt");
  } else {
    read_results(made, end.process.code(), result);
    const fs::path place = fs::path("runs") / run.name();
    if (attempt([&] { put_in_place(made, configuration.night / place); })) {
      result.directory = place.string();
    }
  }
  if (end.too_long) {
    result.outcome = Outcome::error;
    result.error = "no end within " + fixed(configuration.run_timeout_s, 0) + " s: killed";
  }
  return result;
}

/// Of tonight's runs under way, and of those of an interrupted night.
class WorkDirectory {
 public:
  explicit WorkDirectory(const fs::path& night) : path_(night / "work") {
    remove();
    fs::create_directories(path_);
  }
  ~WorkDirectory() { remove(); }
  WorkDirectory(const WorkDirectory&) = delete;
  WorkDirectory& operator=(const WorkDirectory&) = delete;

  fs::path of(const PlannedRun& run) const {
    const fs::path directory = path_ / run.name();
    fs::create_directories(directory);
    return directory;
  }

 private:
  void remove() const {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }

  fs::path path_;
};

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

void read_results(const std::filesystem::path& directory, int exit_code, FinishedRun& run) {
  run.outcome = Outcome::error;
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
      run.error = "its process died of signal " + std::to_string(exit_code - 128);
    } else if (comparison.recorded_outcome == procedure_state_t::NONE) {
      run.error = "its log ends before its verdict (exit code " + std::to_string(exit_code) + ")";
    } else {
      run.outcome = outcome_of_run(comparison.outcome);
      run.error = comparison.reason;
      if (run.error.empty() && !run.passed()) run.error = failed_criteria(comparison.criteria);
    }
  } catch (const std::exception& e) {
    run.error = e.what();
  }
}

std::size_t run_all(const std::vector<PlannedRun>& runs, const RunnerConfiguration& configuration,
                    const std::function<void(FinishedRun)>& finished) {
  const WorkDirectory work(configuration.night);
  fs::create_directories(configuration.night / "runs");
  Pool pool({configuration.jobs, configuration.time_budget_s, configuration.interrupted, {}});
  std::size_t left = runs.size();
  for (const PlannedRun& run : runs) {
    const fs::path out = work.of(run);
    Task task;
    task.program = command_of(run, configuration, out);
    task.output = out / "output.txt";
    task.time_limit_s = configuration.run_timeout_s;
    // The cell is there once, and what runs in real time must not wait for a processor.
    task.alone = in_real_time(run);
    task.ended = [&, out](const TaskEnd& end) {
      if (end.interrupted) return;
      FinishedRun result = finished_run(run, configuration, out, end);
      std::error_code ignored;
      fs::remove_all(out, ignored);
      --left;
      finished(std::move(result));
    };
    pool.add(std::move(task));
  }
  pool.run();
  return left;
}

}  // namespace berth::nights
