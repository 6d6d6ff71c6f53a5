// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/runner.h"

#include <signal.h>
#include <sys/time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>

#include "app/batch/pool.h"
#include "app/batch/shared_values.h"
#include "common/core/error.h"
#include "common/core/text.h"

namespace berth::campaigns {
namespace {

/// Progress of a worker process, in memory that it shares with its parent.
struct WorkerReport {
  static constexpr std::int64_t none = -1;
  std::atomic<bool> ready = false;         ///< its experiment is made
  std::atomic<std::int64_t> block = none;  ///< that it is at work on
  std::atomic<std::int64_t> in_block = 0;  ///< trials of that block that are done
  std::atomic<std::int64_t> finished = 0;  ///< trials of blocks that are finished
  std::atomic<std::int64_t> ran = 0;       ///< trials that it ran itself
};

/// A trial that takes longer ends its process with SIGPROF.
void limit_processor_time(double limit_s) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(limit_s);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (limit_s - std::floor(limit_s)));
  setitimer(ITIMER_PROF, &timer, nullptr);
}

void run_block(const Campaign& campaign, Experiment& experiment, const Block& block,
               WorkerReport& report) {
  BlockWriter results(campaign, block);
  report.in_block = results.next() - block.begin;
  while (results.next() < block.end) {
    limit_processor_time(campaign.manifest().trial_limit_s);
    const TrialResult result = experiment.run(trial_of(campaign.manifest(), results.next()));
    limit_processor_time(0);
    results.add(result);
    ++report.ran;
    ++report.in_block;
  }
  results.finish();
}

/// What a worker process does: the block named first, then those that no worker has taken, one
/// after the other. Their files are written whole or not at all; what an earlier worker left of a
/// block (its .started file) is taken over.
/// @param first of the blocks, or WorkerReport::none
/// @param next of those that no worker has taken, shared by all
/// @throws what the making of its experiment, or a block's files, threw
void work(const Campaign& campaign, const std::vector<Block>& blocks,
          const std::function<std::unique_ptr<Experiment>()>& make_experiment, std::int64_t first,
          std::atomic<std::int64_t>& next, WorkerReport& report) {
  signal(SIGINT, SIG_IGN);  // the terminal's: the parent decides
  for (const int number : {SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS}) {
    signal(number, SIG_DFL);  // whatever the parent does with them
  }
  const auto experiment = make_experiment();
  report.ready = true;
  for (std::int64_t i = first != WorkerReport::none ? first : next++; i < std::ssize(blocks);
       i = next++) {
    const Block& block = blocks[static_cast<std::size_t>(i)];
    report.block = i;
    run_block(campaign, *experiment, block, report);
    report.block = WorkerReport::none;
    report.in_block = 0;
    report.finished += block.size();
  }
}

/// Whether the signal was sent from outside and is not the trial's fault.
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
    BlockWriter results(campaign_, block);
    const std::int64_t index = results.next();
    if (index >= block.end) return;  // all done, but for the block's own file
    if (from_outside(end.signal) && killed_[index]++ == 0) return;
    results.add(crashed(campaign_.manifest(), index, end));
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
