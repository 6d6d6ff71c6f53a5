// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/night.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <set>

#include "app/attempt.h"
#include "app/batch/nights/index_page.h"
#include "app/batch/nights/runner.h"
#include "app/batch/nights/verdict.h"
#include "app/batch/pool.h"
#include "app/directory_lock.h"
#include "app/exit_code.h"
#include "app/terminal/interruption.h"
#include "app/terminal/progress_line.h"
#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/utc.h"
#include "common/core/version.h"

namespace berth::nights {
namespace fs = std::filesystem;
namespace {

/// Of another build.
std::string version_of(const fs::path& program) {
  const ProgramOutput output =
      run_program({"env", "-u", "BERTH_HOME", program.string(), "--version"});
  std::fputs(output.errors.c_str(), stderr);
  if (!output.end.ok() || output.text.empty()) {
    throw InputError("baseline " + program.string() + ": 'berth --version' does not work");
  }
  return output.text.substr(0, output.text.find('\n'));
}

std::string identity(const std::string& version, const fs::path& program) {
  return version + " " + sha256_of_file(program).substr(0, 12);
}

/// The plan with the values given on the command line.
Plan plan_of(const NightRequest& request) {
  Plan plan = load_plan(request.plan);
  if (request.jobs > 0) plan.jobs = request.jobs;
  plan.jobs = jobs_of(plan.jobs);
  if (!request.baseline.empty()) {
    if (!fs::exists(request.baseline)) {
      throw InputError("--baseline " + request.baseline.string() + ": no such program");
    }
    plan.baseline.build = fs::absolute(request.baseline);
  }
  if (fs::is_directory(plan.baseline.build)) plan.baseline.build /= "berth";
  if (!request.config.empty()) {
    if (!fs::is_directory(request.config / "layouts")) {
      throw InputError("--config " + request.config.string() + ": has no layouts/");
    }
    for (Case& of : plan.cases) {
      if (of.config.empty()) of.config = fs::absolute(request.config);
    }
  }
  return plan;
}

std::string free_name(ResultStore& history, const std::string& requested) {
  if (requested.empty()) return history.free_name(utc_text(std::time(nullptr)).substr(0, 10));
  if (!history.batch_named(requested)) return requested;
  throw InputError("--night " + requested + ": there is one of that name");
}

/// The interrupted night, when it was of this plan and these builds; else a new one.
Night open_night(ResultStore& history, const NightRequest& request, const Plan& plan) {
  Night night;
  night.version = version();
  night.plan_hash = sha256(plan.text + "\n" + request.config.string());
  night.build = identity(night.version, request.program);
  if (!plan.baseline.build.empty()) {
    night.baseline = identity(version_of(plan.baseline.build), plan.baseline.build);
  }
  for (Night& last : history.batches()) {
    if (!last.ended.empty()) continue;
    const bool same = last.plan_hash == night.plan_hash && last.build == night.build &&
                      last.baseline == night.baseline;
    if (same && !request.afresh && (request.name.empty() || request.name == last.name)) {
      std::printf("night %s was interrupted: resumed\n", last.name.c_str());
      return last;
    }
    std::printf("night %s was interrupted%s: left as it is\n", last.name.c_str(),
                same ? "" : ", with another plan or build");
    last.ended = utc_text(std::time(nullptr));
    last.verdict = "interrupted";
    history.finish(last, {});
  }
  night.name = free_name(history, request.name);
  night.begun = utc_text(std::time(nullptr));
  history.begin(night);
  return night;
}

std::string key_of(const std::string& case_name, Build build, std::uint64_t seed) {
  return case_name + "\n" + name_of(build) + "\n" + std::to_string(seed);
}

std::vector<PlannedRun> without_finished(std::vector<PlannedRun> planned,
                                         const std::vector<FinishedRun>& finished) {
  std::set<std::string> done;
  for (const FinishedRun& run : finished) done.insert(key_of(run.case_name, run.build, run.seed));
  planned.erase(std::remove_if(planned.begin(), planned.end(),
                               [&](const PlannedRun& run) {
                                 return done.count(key_of(run.of->name, run.build, run.seed)) != 0;
                               }),
                planned.end());
  return planned;
}

/// Directories of passed runs are many and large: the newest few stay, those of all others too.
class RetentionPolicy {
 public:
  RetentionPolicy(fs::path out, int max_passed) : out_(std::move(out)), max_passed_(max_passed) {}

  /// Deletes the directory of a passed run unless it is one of those that stay.
  void judge(const Night& night, FinishedRun& run) {
    if (run.directory.empty() || !run.passed() || kept_++ < max_passed_) return;
    std::error_code ignored;
    fs::remove_all(out_ / night.name / run.directory, ignored);
    run.directory.clear();
  }

  void judge_earlier_nights(ResultStore& history, const Night& tonight) {
    auto nights = history.batches();
    std::reverse(nights.begin(), nights.end());
    for (const Night& night : nights) {
      if (night.id == tonight.id) continue;
      for (FinishedRun& run : history.runs(night, ResultStore::Which::all_without_values)) {
        const std::string directory = run.directory;
        judge(night, run);
        if (run.directory.empty() && !directory.empty()) history.forget_directory(night, directory);
      }
    }
  }

 private:
  fs::path out_;
  int max_passed_;
  int kept_ = 0;
};

/// By case; of a procedure that cannot be read any more there are none.
std::map<std::string, std::vector<evaluation::Criterion>> criteria_by_case(const Plan& plan) {
  std::map<std::string, std::vector<evaluation::Criterion>> criteria;
  for (const Case& of : plan.cases) {
    try {
      criteria[of.name] = criteria_of(of);
    } catch (const InputError&) {  // its runs report it
    }
  }
  return criteria;
}

/// What tonight is compared with: good nights since the last one that was accepted.
Evidence evidence_for(ResultStore& history, const Plan& plan, const Night& tonight,
                      const std::vector<FinishedRun>& runs) {
  Evidence evidence;
  evidence.criteria = criteria_by_case(plan);
  std::set<std::string> compared;
  for (const Case& of : plan.cases) {
    if (of.is_compared()) compared.insert(of.name);
  }
  for (const FinishedRun& run : runs) {
    if (compared.count(run.case_name) == 0) continue;
    (run.build == Build::tonight ? evidence.tonight : evidence.baseline).push_back(run);
  }
  const auto tonights_only = [](std::vector<FinishedRun>& list) {
    list.erase(std::remove_if(list.begin(), list.end(),
                              [](const FinishedRun& r) { return r.build != Build::tonight; }),
               list.end());
  };
  auto nights = history.batches();
  std::reverse(nights.begin(), nights.end());
  int nights_compared = 0;
  for (const Night& night : nights) {
    if (night.number >= tonight.number || !night.good()) continue;
    if (nights_compared == 0) {
      evidence.last_night = history.runs(night, ResultStore::Which::fixed);
      tonights_only(evidence.last_night);
    }
    for (FinishedRun& run : history.runs(night, ResultStore::Which::fresh)) {
      evidence.history.push_back(std::move(run));
    }
    if (++nights_compared == plan.history_nights || night.accepted) break;
  }
  return evidence;
}

/// One hash for the configurations of all runs.
std::string configuration_of(const std::vector<FinishedRun>& runs) {
  std::set<std::string> hashes;
  for (const FinishedRun& run : runs) {
    if (run.build == Build::tonight && !run.configuration_hash.empty()) {
      hashes.insert(run.case_name + " " + run.configuration_hash);
    }
  }
  std::string list;
  for (const auto& hash : hashes) list += hash + "\n";
  return list.empty() ? "" : sha256(list);
}

std::optional<Night> night_before(ResultStore& history, const Night& tonight) {
  std::optional<Night> previous;
  for (const Night& night : history.batches()) {
    if (night.number < tonight.number && night.verdict != "interrupted") previous = night;
  }
  return previous;
}

/// Of a run that did not pass.
std::string line_of(const FinishedRun& run) {
  return std::string(name_of(run.outcome)) + " " + run.case_name + " seed " +
         std::to_string(run.seed) + (run.build == Build::baseline ? " (baseline)" : "") + ": " +
         run.error;
}

}  // namespace

int run_night(const NightRequest& request) {
  const Plan plan = plan_of(request);
  const fs::path out = fs::absolute(request.out);
  const DirectoryLock lock(out);
  ResultStore history(out / "history.sqlite");
  NightReport report;
  report.out = out;
  Night& night = report.night = open_night(history, request, plan);
  const fs::path directory = out / night.name;
  fs::create_directories(directory);
  write_file(directory / "plan.yaml", plan.text);

  const auto planned = runs_of_night(plan, night.number);
  const auto finished = history.runs(night, ResultStore::Which::all_without_values);
  const auto to_run = without_finished(planned, finished);
  std::printf("night %s: %zu runs, %d at a time, in %s\n", night.name.c_str(), to_run.size(),
              plan.jobs, directory.c_str());
  std::fflush(stdout);
  RetentionPolicy retention(out, plan.keep);
  for (FinishedRun run : finished) retention.judge(night, run);
  const double before_s = night.wall_s;
  {
    terminal::ProgressLine progress("runs", std::ssize(planned));
    const auto before = static_cast<double>(planned.size() - to_run.size());
    double done = before;
    int not_passed = 0;
    const RunnerConfiguration configuration{
        request.program,    directory,          plan.baseline,        plan.jobs,
        plan.run_timeout_s, plan.time_budget_s, terminal::interrupted};
    terminal::watch_for_interruption();
    report.left_out = run_all(to_run, configuration, [&](FinishedRun run) {
      retention.judge(night, run);
      night.wall_s = before_s + progress.elapsed_s();
      history.record(night, {run});
      if (!run.passed()) {
        ++not_passed;
        progress.print(line_of(run));
      }
      progress.show(++done, std::to_string(not_passed) + " did not pass", before);
    });
    night.wall_s = before_s + progress.elapsed_s();
    if (terminal::interrupted()) {
      progress.print("interrupted with " + std::to_string(report.left_out) +
                     " runs to go: the same command goes on with them");
      return exit_code::aborted;
    }
    terminal::end_on_interruption();
  }

  report.previous = night_before(history, night);
  report.runs = history.runs(night);
  report.changes = find_changes(evidence_for(history, plan, night, report.runs),
                                plan.family_wise_alpha, plan.minimum_effect);
  if (!plan.archive.runs.empty()) {
    std::printf("archive: the runs in %s are estimated again\n", plan.archive.runs.c_str());
    std::fflush(stdout);
    report.archive = estimate_archive(plan, request.program, directory);
  }
  night.configuration_hash = configuration_of(report.runs);
  judge(plan, report);
  night.ended = utc_text(std::time(nullptr));
  history.finish(night, report.changes.changes);
  attempt([&] { retention.judge_earlier_nights(history, night); });

  attempt([&] { write_file(directory / "results.xml", junit_of(report)); });
  attempt([&] { write_file(directory / "summary.txt", text_of(report)); });
  attempt([&] { write_index_page(plan, history, report); });
  if (!plan.notify.empty()) report.notification = notify(plan.notify, report, request.program);
  attempt([&] { write_file(directory / "summary.json", json_of(report)); });
  std::printf("\n%s\n%s\n", text_of(report).c_str(), (out / "index.html").c_str());
  std::fflush(stdout);
  if (!report.notification.empty()) std::fprintf(stderr, "%s\n", report.notification.c_str());
  return report.exit_code();
}

void accept_night(const fs::path& out, const std::string& name) {
  if (!fs::exists(out / "history.sqlite")) {
    throw InputError("--out " + out.string() + ": no history.sqlite there");
  }
  const DirectoryLock lock(out);
  ResultStore history(out / "history.sqlite");
  history.accept(name);
}

}  // namespace berth::nights
