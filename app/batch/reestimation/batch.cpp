// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/batch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>

#include "app/batch/pool.h"
#include "app/batch/run_results.h"
#include "app/batch/shared_values.h"
#include "app/runs/run_list.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "common/core/utc.h"
#include "common/core/version.h"

namespace berth {
namespace {

namespace fs = std::filesystem;

/// A directory that is not there yet, named like the run.
fs::path new_directory(const fs::path& log, const fs::path& out) {
  const fs::path home = fs::absolute(log).parent_path();
  const bool is_run = log.filename() == "run.lcm" && fs::exists(home / "run.yaml");
  const std::string name = (is_run ? home.filename() : log.stem()).string();
  fs::create_directories(out);
  for (int i = 1;; ++i) {
    const fs::path directory = out / (i == 1 ? name : name + "-" + std::to_string(i));
    std::error_code error;
    if (fs::create_directory(directory, error)) return directory;
    if (error) throw InputError("--out " + out.string() + ": " + error.message());
  }
}

/// Progress and result of a run, in memory shared with its process.
struct RunReport {
  std::atomic<double> share = 0;  // of it that is done
  Reestimation result;
};

/// In a process of its own: one that crashes takes no other run down.
void reestimate(const BatchRun& run, const BatchRequest& request, RunReport& report) {
  const RunFiles files = make_new_run(run.recorded, request.changes, run.again);
  report.result = reestimate_log(run.recorded, files, [&](double share) { report.share = share; });
  if (report.result.recorded == 0 && report.result.estimates == 0) {
    throw InputError("it holds no scans to estimate from");
  }
}

/// Reads and judges a run. @param name of the batch's run: that of its new directory
evaluation::RunRecord read(const fs::path& log, const std::string& name, FinishedRun& results) {
  evaluation::ComparedRun run = evaluation::compare_run(log);
  take_results(run, results);
  results.case_name = name;
  results.procedure = run.comparison.procedure;
  if (const auto& info = run.comparison.info) {
    results.seed = static_cast<std::uint64_t>(info->seed);
    results.target = info->target;
    results.host = evaluation::text_of_host(info->host);
  }
  return std::move(run.record);
}

void compare(BatchRun& run, const BatchRequest& request) {
  const std::string name = run.again.filename().string();
  run.before = read(run.recorded, name, run.as_recorded);
  run.after = read(run.again / "run.lcm", name, run.as_again);
  run.change = evaluation::find_change({{&run.before, &run.after}}, request.level);
}

void finish(BatchRun& run, const BatchRequest& request, const RunReport& report,
            const TaskEnd& end) {
  try {
    if (!end.process.ok()) {
      throw InputError(end.error.empty() ? "its process " + end.process.text() : end.error);
    }
    run.result = report.result;
    compare(run, request);
  } catch (const std::exception& error) {
    run.error = error.what();
    std::error_code ignored;
    fs::remove_all(run.again, ignored);  // half a run is of no use
  }
}

std::vector<FlaggedChange> flagged(const evaluation::Change& change) {
  std::vector<FlaggedChange> list;
  for (const evaluation::ChangeRow& row : change.rows) {
    const bool better = row.judgement == evaluation::Judgement::better;
    if (!better && row.judgement != evaluation::Judgement::worse) continue;
    const evaluation::PairedDifference& d = row.difference;
    list.push_back({"recorded", "", row.phase, row.measurement, row.statistic, row.unit, d.before,
                    d.after, d.low, d.high, row.adjusted_p, better ? "better" : "worse",
                    change.runs});
  }
  return list;
}

/// Adds it to the results in its directory.
void keep(const Batch& batch, const BatchRequest& request, BatchRecord record) {
  ResultStore store(request.out / "results.sqlite");
  record.name = store.free_name(record.begun);
  record.version = record.build = version();
  store.begin(record);
  std::vector<FinishedRun> runs;
  for (const BatchRun& run : batch.runs) {
    const std::string name = run.again.filename().string();
    if (run.error.empty()) {
      runs.push_back(run.as_recorded);
      runs.back().build = Build::baseline;
      runs.push_back(run.as_again);
      runs.back().directory = name;
    } else {
      runs.emplace_back().error = run.error;
      runs.back().case_name = name;
    }
    FinishedRun& again = runs.back();
    again.wall_s = run.result.wall_s;
    again.details = {{"recorded", run.recorded.string()},
                     {"config", request.changes.config.string()},
                     {"set", joined(request.changes.set)},
                     {"estimates", std::to_string(run.result.estimates)},
                     {"estimates_same", std::to_string(run.result.same)}};
  }
  store.record(record, runs);
  record.ended = utc_text(std::time(nullptr));
  record.verdict = batch.identical() ? "identical" : batch.change.verdict();
  store.finish(record, flagged(batch.change));
}

}  // namespace

bool Batch::failed() const {
  return std::any_of(runs.begin(), runs.end(),
                     [](const BatchRun& run) { return !run.error.empty(); });
}

bool Batch::identical() const {
  return std::all_of(runs.begin(), runs.end(), [](const BatchRun& run) {
    return run.error.empty() && run.result.identical();
  });
}

Batch reestimate(const BatchRequest& request, const ShareDone& share_done) {
  Batch batch;
  BatchRecord record;
  record.begun = utc_text(std::time(nullptr));
  const auto begun = std::chrono::steady_clock::now();
  for (const fs::path& path : request.runs) {
    BatchRun run;
    run.recorded = log_of_run(path.string());
    run.again = new_directory(run.recorded, request.out);
    batch.runs.push_back(std::move(run));
  }
  SharedValues<RunReport> reports(batch.runs.size());
  Pool pool({request.jobs, 0, {}, [&] {
               double sum = 0;
               for (std::size_t i = 0; i < batch.runs.size(); ++i) sum += reports[i].share;
               if (share_done) share_done(sum / static_cast<double>(batch.runs.size()));
             }});
  for (std::size_t i = 0; i < batch.runs.size(); ++i) {
    Task task;
    task.body = [&, i] { reestimate(batch.runs[i], request, reports[i]); };
    task.ended = [&, i](const TaskEnd& end) {
      reports[i].share = 1;
      finish(batch.runs[i], request, reports[i], end);
    };
    pool.add(std::move(task));
  }
  pool.run();
  std::vector<evaluation::RecordPair> pairs;
  for (const BatchRun& run : batch.runs) {
    if (run.error.empty()) pairs.push_back({&run.before, &run.after});
  }
  batch.change =
      pairs.size() == 1 ? batch.runs[0].change : evaluation::find_change(pairs, request.level);
  record.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  keep(batch, request, record);
  return batch;
}

}  // namespace berth
