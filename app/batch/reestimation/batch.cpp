// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/batch.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "app/batch/parallel.h"
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

void reestimate(BatchRun& run, const BatchRequest& request, const ShareDone& share_done) {
  const RunFiles files = make_new_run(run.recorded, request.changes, run.again);
  run.result = reestimate_log(run.recorded, files, share_done);
  if (run.result.recorded == 0 && run.result.estimates == 0) {
    throw InputError("it holds no scans to estimate from");
  }
  evaluation::LogSummary summary;
  run.before = evaluation::read_run(run.recorded, summary);
  run.after = evaluation::read_run(files.log(), summary);
  run.change = find_change({{&run.before, &run.after}}, request.level);
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
  std::vector<std::atomic<double>> shares(batch.runs.size());
  in_parallel(batch.runs.size(), request.jobs, [&](std::size_t i) {
    const auto tell = [&](double share) {
      shares[i] = share;
      if (!share_done) return;
      share_done(std::accumulate(shares.begin(), shares.end(), 0.0) /
                 static_cast<double>(shares.size()));
    };
    try {
      reestimate(batch.runs[i], request, tell);
    } catch (const std::exception& error) {
      batch.runs[i].error = error.what();
      std::error_code ignored;
      fs::remove_all(batch.runs[i].again, ignored);  // half a run says nothing
    }
    tell(1);
  });
  std::vector<RecordPair> pairs;
  for (const BatchRun& run : batch.runs) {
    if (run.error.empty()) pairs.push_back({&run.before, &run.after});
  }
  batch.change = pairs.size() == 1 ? batch.runs[0].change : find_change(pairs, request.level);
  return batch;
}

}  // namespace berth
