// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "app/batch/reestimation/estimator_fold.h"

namespace berth {

/// An estimator beside a replay, on a thread of its own, so that the replay keeps its times: takes
/// recorded scans and commands in their order and publishes what it makes of them.
class LiveEstimator {
 public:
  /// @param publish is called on the estimator's thread
  /// @throws InputError for what is wrong in the configuration
  LiveEstimator(const RunFiles& files, Utime start, FoldBus::Outlet publish);
  ~LiveEstimator();
  LiveEstimator(const LiveEstimator&) = delete;
  LiveEstimator& operator=(const LiveEstimator&) = delete;

  /// Any message of the log; the inputs wait for the estimator, all others only set its time.
  void take(const logs::LogEvent& event);
  /// Forgets everything: an estimator that starts at this time of the log.
  void restart(Utime start);
  /// Returns when all that was taken is worked off, or at once when it must stop.
  void finish();
  /// Inputs that wait.
  std::size_t waiting();
  /// What ended it; empty as long as it works.
  std::string error();

 private:
  struct Task {
    bool restart = false;
    Utime utime = 0;
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };

  void work();
  void carry_out(const Task& task);
  void put(Task task);

  const RunFiles& files_;
  FoldBus::Outlet publish_;
  std::unique_ptr<EstimatorFold> fold_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Task> tasks_;
  bool working_ = false;
  bool stopping_ = false;
  std::string error_;
  std::thread thread_;
};

}  // namespace berth
