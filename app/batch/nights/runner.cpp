// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/runner.h"

#include <signal.h>

#include <algorithm>
#include <fstream>

#include "app/attempt.h"
#include "app/batch/nights/run_values.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/text.h"

namespace berth::nights {
namespace fs = std::filesystem;
namespace {

bool in_real_time(const PlannedRun& run) { return run.of->host != "twin"; }

std::vector<std::string> command_of(const PlannedRun& run, const RunnerConfiguration& workshop,
                                    const fs::path& out) {
  const bool baseline = run.build == Build::baseline;
  std::vector<std::string> words{"/usr/bin/env"};
  // A build finds its own files; ours must not be taken for those of another.
  if (baseline) words.insert(words.end(), {"-u", "BERTH_HOME"});
  words.push_back(baseline ? workshop.baseline.build.string() : workshop.program.string());
  words.insert(words.end(), {"run", "--seed", std::to_string(run.seed), "--out", out.string()});
  if (run.of->host == "twin") words.push_back("--twin");
  if (run.of->host == "cell") words.push_back("--hardware");
  if (run.of->host == "simulated-cell") {
    words.insert(words.end(), {"--lcm-url", "udpm://239.255.76.67:7711?ttl=0"});
  }
  if (!run.of->target.empty()) words.insert(words.end(), {"--target", run.of->target});
  const fs::path config = baseline ? workshop.baseline.config : run.of->config;
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

}  // namespace

struct Runner::Job {
  PlannedRun run;
  fs::path out;
  Utime begun = 0;
  Loop::TimerId limit = 0;
  bool too_long = false;
  std::unique_ptr<WatchedProcess> process;
};

Runner::Runner(ProcessLoop& loop, RunnerConfiguration workshop)
    : loop_(loop), workshop_(std::move(workshop)) {
  std::error_code ignored;
  fs::remove_all(workshop_.night / "work", ignored);  // of an interrupted night
  fs::create_directories(workshop_.night / "work");
  fs::create_directories(workshop_.night / "runs");
  loop_.on_signals([this](int) {
    interrupted_ = true;
    for (const auto& job : jobs_) left_.push_back(job->run);
    jobs_.clear();
    loop_.stop();
  });
}

Runner::~Runner() {
  jobs_.clear();
  std::error_code ignored;
  fs::remove_all(workshop_.night / "work", ignored);
}

std::vector<PlannedRun> Runner::run(std::vector<PlannedRun> runs, const Finished& finished) {
  waiting_ = std::move(runs);
  std::reverse(waiting_.begin(), waiting_.end());
  finished_ = finished;
  left_.clear();
  begun_ = loop_.now();
  start_what_fits();
  if (!jobs_.empty()) loop_.run();
  left_.insert(left_.end(), waiting_.rbegin(), waiting_.rend());
  return std::move(left_);
}

bool Runner::may_start(const PlannedRun& run) const {
  if (jobs_.size() >= static_cast<std::size_t>(workshop_.jobs)) return false;
  // The cell is there once, and what runs in real time must not wait for a processor.
  if (jobs_.empty()) return true;
  return !in_real_time(run) && !in_real_time(jobs_.front()->run);
}

void Runner::start_what_fits() {
  const bool time_is_up =
      workshop_.time_budget_s > 0 && seconds(loop_.now() - begun_) > workshop_.time_budget_s;
  while (!interrupted_ && !time_is_up && !waiting_.empty() && may_start(waiting_.back())) {
    const PlannedRun run = waiting_.back();
    waiting_.pop_back();
    start(run);
  }
}

void Runner::start(const PlannedRun& run) {
  auto job = std::make_unique<Job>();
  job->run = run;
  job->out = workshop_.night / "work" / run.name();
  job->begun = loop_.now();
  fs::create_directories(job->out);
  Job* const at = job.get();
  jobs_.push_back(std::move(job));
  at->limit = loop_.at(loop_.now() + utime_from_seconds(workshop_.run_timeout_s), [at] {
    at->too_long = true;
    at->process->signal(SIGKILL);
  });
  // Not from within the process' own callback: it goes with its job.
  at->process =
      std::make_unique<WatchedProcess>(loop_, command_of(run, workshop_, at->out),
                                       at->out / "output.txt", [this, at](const ProcessEnd& end) {
                                         loop_.post([this, at, end] {
                                           if (!interrupted_) ended(*at, end);
                                         });
                                       });
}

void Runner::ended(Job& job, const ProcessEnd& end) {
  loop_.cancel(job.limit);
  const PlannedRun run = job.run;
  FinishedRun result;
  result.case_name = run.of->name;
  result.build = run.build;
  result.seed = run.seed;
  result.fresh = run.fresh;
  result.procedure = run.of->procedure.string();
  attempt([&] { result.procedure_hash = procedure_hash(*run.of); });
  result.target = run.of->target;
  result.host = run.of->host;
  result.wall_s = seconds(loop_.now() - job.begun);
  result.cpu_s = end.user_s + end.system_s;

  const std::string output = last_line(job.out / "output.txt");
  const fs::path made = made_in(job.out);
  if (made.empty()) {
    result.outcome = "ERROR";
    result.reason = "it made no run directory (" + end.name() + "): " + output;
  } else {
    read_results(made, end.code(), result);
    const fs::path place = fs::path("runs") / run.name();
    if (attempt([&] { put_in_place(made, workshop_.night / place); })) {
      result.directory = place.string();
    }
  }
  if (job.too_long) {
    result.outcome = "ERROR";
    result.reason = "no end within " + fixed(workshop_.run_timeout_s, 0) + " s: killed";
  }
  std::error_code ignored;
  fs::remove_all(job.out, ignored);
  jobs_.remove_if([&](const auto& other) { return other.get() == &job; });
  finished_(run, std::move(result));
  start_what_fits();
  if (jobs_.empty()) loop_.stop();
}

}  // namespace berth::nights
