// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/runner.h"

#include <poll.h>
#include <signal.h>

#include <chrono>
#include <deque>
#include <list>
#include <map>

#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/worker.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"

namespace berth::campaigns {
namespace {

constexpr int look_about_ms = 250;

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
      : campaign_(campaign), options_(options) {
    for (const Block& block : blocks) {
      total_ += block.size();
      if (std::filesystem::exists(campaign.block_file(block))) {
        finished_ += block.size();
      } else {
        waiting_.push_back(block);
      }
    }
  }

  RunnerCost run() {
    const auto begin = std::chrono::steady_clock::now();
    hand_out();
    while (!workers_.empty()) {
      wait();
      receive();
      hand_out();
      report();
      if (options_.interrupted && options_.interrupted()) break;
    }
    for (const auto& worker : workers_) {
      worker->stop();
      add_up(*worker);
    }
    workers_.clear();
    cost_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return cost_;
  }

 private:
  /// As many workers as there is work for, and a block for each that has none.
  void hand_out() {
    std::size_t coming = 0;
    for (const auto& worker : workers_) {
      if (!worker->was_ready()) ++coming;
      if (!worker->idle()) continue;
      if (waiting_.empty()) {
        worker->finish();
      } else {
        worker->begin(waiting_.front());
        waiting_.pop_front();
      }
    }
    const auto jobs = static_cast<std::size_t>(options_.jobs);
    for (; workers_.size() < jobs && coming < waiting_.size(); ++coming) {
      workers_.push_back(std::make_unique<Worker>(campaign_, options_.make));
    }
  }

  void wait() const {
    std::vector<pollfd> all;
    for (const auto& worker : workers_) all.push_back({worker->descriptor(), POLLIN, 0});
    poll(all.data(), all.size(), look_about_ms);
  }

  void receive() {
    for (auto worker = workers_.begin(); worker != workers_.end();) {
      if ((*worker)->listen()) {
        ++worker;
        continue;
      }
      const auto ended = std::move(*worker);
      worker = workers_.erase(worker);
      add_up(*ended);
      see_why(*ended);
    }
  }

  /// Of a worker that has ended.
  void add_up(const Worker& worker) {
    finished_ += worker.finished();
    cost_.trials += worker.ran();
    cost_.user_s += worker.end().user_s;
    cost_.system_s += worker.end().system_s;
  }

  void see_why(const Worker& worker) {
    if (!worker.error().empty()) throw InputError(worker.error());
    const ProcessEnd& end = worker.end();
    if (end.signal == 0 && !worker.block() && worker.was_ready()) return;  // it was done
    if (!worker.was_ready()) {
      throw InputError("a worker " + end.text() + " before its first trial; see " +
                       (campaign_.directory() / "output.txt").string());
    }
    if (!worker.block()) return;
    give_up_trial(*worker.block(), end);  // exit() within a trial repeats itself as a signal does
    waiting_.push_front(*worker.block());
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

  void report() const {
    if (!options_.report) return;
    RunnerProgress progress;
    progress.total = total_;
    progress.done = finished_;
    progress.done_now = cost_.trials;
    progress.workers = static_cast<int>(workers_.size());
    for (const auto& worker : workers_) {
      progress.done += worker->finished() + worker->in_block();
      progress.done_now += worker->ran();
    }
    options_.report(progress);
  }

  const Campaign& campaign_;
  const RunnerOptions& options_;
  std::deque<Block> waiting_;
  std::list<std::unique_ptr<Worker>> workers_;
  std::map<std::int64_t, int> killed_;  // how often from outside, by trial
  std::int64_t total_ = 0;
  std::int64_t finished_ = 0;
  RunnerCost cost_;
};

}  // namespace

RunnerCost run_blocks(const Campaign& campaign, const std::vector<Block>& blocks,
                      const RunnerOptions& options) {
  return Runner(campaign, blocks, options).run();
}

}  // namespace berth::campaigns
