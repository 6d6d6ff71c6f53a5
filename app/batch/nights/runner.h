// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <list>
#include <memory>

#include "app/batch/nights/history.h"
#include "app/runs/watched_process.h"

namespace berth::nights {

/// Where and how runs happen.
struct RunnerConfiguration {
  std::filesystem::path program;  ///< tonight's `berth`
  std::filesystem::path night;    ///< the night's directory: runs/ and work/ are made in it
  Baseline baseline;
  int jobs = 1;
  double run_timeout_s = 600;
  double time_budget_s = 0;  ///< 0: none
};

/// Runs procedures as child processes, several at a time, and reads what came of them. A run that
/// crashes or does not end is a result, never the end of the night.
class Runner {
 public:
  using Finished = std::function<void(const PlannedRun&, FinishedRun)>;

  Runner(ProcessLoop& loop, RunnerConfiguration workshop);
  ~Runner();

  /// Until all have run, the time budget is used up, or a signal comes (SIGINT, SIGTERM: the runs
  /// at work are given up; a later night takes them up again).
  /// @return the runs that were not begun or given up
  std::vector<PlannedRun> run(std::vector<PlannedRun> runs, const Finished& finished);
  bool interrupted() const { return interrupted_; }

 private:
  struct Job;
  void start_what_fits();
  void start(const PlannedRun& run);
  void ended(Job& job, const ProcessEnd& end);
  bool may_start(const PlannedRun& run) const;

  ProcessLoop& loop_;
  RunnerConfiguration workshop_;
  Finished finished_;
  std::vector<PlannedRun> waiting_;  // last first
  std::list<std::unique_ptr<Job>> jobs_;
  std::vector<PlannedRun> left_;
  Utime begun_ = 0;
  bool interrupted_ = false;
};

}  // namespace berth::nights
