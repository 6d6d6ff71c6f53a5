// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/pose_estimate_t.hpp>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/batch/reestimation/estimator_fold.h"
#include "common/bus/loop.h"

namespace berth {

/// Compares the estimates of a live estimator with the recorded ones of the same returns, whichever
/// comes first.
class EstimatePairs {
 public:
  /// @param show takes a line for each pair
  /// @param start of the log: times are shown after it
  EstimatePairs(Utime start, std::function<void(const std::string& line)> show)
      : start_(start), show_(std::move(show)) {}

  void recorded(const pose_estimate_t& estimate);
  void live(const pose_estimate_t& estimate);
  /// What waits for its other half waits no more: the player jumped.
  void forget();

  static std::string heading();
  std::string summary() const;
  std::int64_t pairs() const { return pairs_; }
  /// In all digits but those of seq, which counts messages, not measurements.
  std::int64_t same() const { return same_; }

 private:
  struct Half {
    std::optional<pose_estimate_t> recorded;
    std::optional<pose_estimate_t> live;
  };
  void compare_if_both(std::map<std::pair<std::int64_t, std::int32_t>, Half>::iterator at);

  Utime start_;
  std::function<void(const std::string&)> show_;
  std::map<std::pair<std::int64_t, std::int32_t>, Half> halves_;  // by scan and last packet
  std::int64_t pairs_ = 0;
  std::int64_t same_ = 0;
  std::int64_t both_good_ = 0;
  double largest_m_ = 0;
  double largest_rad_ = 0;
};

/// An estimator that runs along with a replay, on a thread of its own, so that the replay keeps its
/// times: takes recorded scans and commands in their order and publishes its results.
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
