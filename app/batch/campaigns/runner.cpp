// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/runner.h"

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>

#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/worker.h"
#include "app/batch/pool.h"
#include "app/batch/shared_values.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"

namespace berth::campaigns {
namespace {

/// Whoever sent these meant the process and not the trial.
bool from_outside(int signal) {
  return signal == SIGKILL || signal == SIGTERM || signal == SIGINT || signal == SIGHUP;
}

TrialResult crashed(const Manifest& manifest, std::int64_t index, const ProcessEnd& end) {
  TrialResult result = result_for(trial_of(manifest, index));
  result.outcome = Outcome::crashed;
  if (end.signal == SIGPROF) {
    result.failure = "too much processor time";
    result.error = "ended after " + shown(manifest.trial_limit_s) + " s of processor time";
  } else {
    result.failure = end.name();
    result.error = "the worker " + end.text();
  }
  return result;
}

class Runner {
 public:
  Runner(const Campaign& campaign, const std::vector<Block>& blocks, const RunnerOptions& options)
      : campaign_(campaign),
        options_(options),
        pool_({options.jobs, 0, options.interrupted, [this] { report_progress(); }}),
        next_(1),
        reports_(static_cast<std::size_t>(options.jobs)) {
    for (const Block& block : blocks) {
      if (std::filesystem::exists(campaign.block_file(block))) {
        finished_ += block.size();
      } else {
        blocks_.push_back(block);
      }
    }
  }
  ~Runner() {
    std::error_code ignored;
    for (const pid_t worker : workers_) {
      std::filesystem::remove_all(work_directory_of(worker), ignored);
    }
  }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  RunnerCost run() {
    const auto begin = std::chrono::steady_clock::now();
    const std::int64_t workers = std::min<std::int64_t>(options_.jobs, std::ssize(blocks_));
    for (std::int64_t seat = 0; seat < workers; ++seat) add_worker(seat, WorkerReport::none);
    pool_.run();
    cost_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return cost_;
  }

 private:
  /// @param first block that it does
  void add_worker(std::int64_t seat, std::int64_t first) {
    WorkerReport& report = reports_[static_cast<std::size_t>(seat)];
    Task task;
    task.body = [this, &report, first] {
      work(campaign_, blocks_, options_.make, first, next_[0], report);
    };
    task.output = campaign_.directory() / "output.txt";
    task.ended = [this, seat](const TaskEnd& end) { ended(seat, end); };
    pool_.add_first(std::move(task));
  }

  void ended(std::int64_t seat, const TaskEnd& end) {
    WorkerReport& report = reports_[static_cast<std::size_t>(seat)];
    workers_.push_back(end.pid);
    finished_ += report.finished;
    cost_.trials += report.ran;
    cost_.user_s += end.process.user_s;
    cost_.system_s += end.process.system_s;
    const std::int64_t block = report.block;
    const bool ready = report.ready;
    std::destroy_at(&report);  // it is counted; the seat is the next one's
    std::construct_at(&report);
    if (end.interrupted || (end.process.ok() && ready)) return;
    if (!end.error.empty()) throw InputError(end.error);
    if (!ready) {
      throw InputError("a worker " + end.process.text() + " before its first trial; see " +
                       (campaign_.directory() / "output.txt").string());
    }
    // exit() within a trial repeats itself as a signal does
    if (block != WorkerReport::none) {
      give_up_trial(blocks_[static_cast<std::size_t>(block)], end.process);
    }
    add_worker(seat, block);
  }

  /// The first trial of a block without a result is the one that the worker died of.
  void give_up_trial(const Block& block, const ProcessEnd& end) {
    const auto file = campaign_.started_file(block);
    const auto results = read_whole_lines(file);
    const std::int64_t index = block.begin + static_cast<std::int64_t>(results.size());
    if (index >= block.end) return;  // all done, but for the block's own file
    if (from_outside(end.signal) && killed_[index]++ == 0) return;
    std::string lines;
    for (const TrialResult& result : results) lines += line_of(result) + "\n";
    write_file(file, lines + line_of(crashed(campaign_.manifest(), index, end)) + "\n");
  }

  void report_progress() const {
    if (!options_.report) return;
    RunnerProgress progress;
    progress.done = finished_;
    progress.done_now = cost_.trials;
    progress.workers = static_cast<int>(pool_.running());
    for (std::size_t i = 0; i < static_cast<std::size_t>(options_.jobs); ++i) {
      progress.done += reports_[i].finished + reports_[i].in_block;
      progress.done_now += reports_[i].ran;
    }
    options_.report(progress);
  }

  const Campaign& campaign_;
  const RunnerOptions& options_;
  Pool pool_;
  std::vector<Block> blocks_;                     // without a result
  SharedValues<std::atomic<std::int64_t>> next_;  // of the blocks that no worker has taken
  SharedValues<WorkerReport> reports_;            // of the worker in each seat
  std::vector<pid_t> workers_;                    // that have ended
  std::map<std::int64_t, int> killed_;            // how often from outside, by trial
  std::int64_t finished_ = 0;
  RunnerCost cost_;
};

}  // namespace

RunnerCost run_blocks(const Campaign& campaign, const std::vector<Block>& blocks,
                      const RunnerOptions& options) {
  return Runner(campaign, blocks, options).run();
}

}  // namespace berth::campaigns
