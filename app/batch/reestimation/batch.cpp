// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/batch.h"

#include <algorithm>
#include <atomic>

#include "app/batch/pool.h"
#include "app/batch/shared_values.h"
#include "app/runs/run_list.h"
#include "common/core/error.h"

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

void compare(BatchRun& run, const BatchRequest& request) {
  evaluation::LogSummary summary;
  run.before = evaluation::read_run(run.recorded, summary);
  run.after = evaluation::read_run(run.again / "run.lcm", summary);
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
  return batch;
}

}  // namespace berth
