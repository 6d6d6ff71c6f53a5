// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/runner.h"

#include <algorithm>
#include <cmath>

#include "app/attempt.h"
#include "app/batch/pool.h"
#include "app/batch/run_results.h"
#include "app/runs/watched_process.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/text.h"

namespace berth::nights {
namespace fs = std::filesystem;
namespace {

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
