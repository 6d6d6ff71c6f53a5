// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/bus/loop.h"

namespace berth {

class ProcessLoop;

/// Long work of a node, on a thread of its own: jobs run one after another, in the order in which
/// they were given. What a job touches is the worker's from give() until the job's `done` runs.
/// Given by Loop::make_worker. Called from the loop only.
class Worker {
 public:
  struct Job {
    std::string name;            ///< for the operator, e.g. "planning command 12"
    Utime budget = 0;            ///< us from when it may begin; a longer job is a fault
    std::function<void()> run;   ///< on the worker's thread
    std::function<void()> done;  ///< then, on the loop
  };
  /// The job under way has taken longer than its budget.
  struct Overdue {
    std::string name;
    Utime budget = 0;  ///< us
  };

  /// Waits for the end of the job under way; drops the waiting jobs and the pending `done` calls.
  virtual ~Worker() = default;
  virtual void give(Job job) = 0;
  /// Jobs given whose `done` has not run yet.
  virtual std::size_t waiting() const = 0;
  virtual std::optional<Overdue> overdue() const = 0;
};

/// A thread of its own, of normal priority, named "worker". An exception of a job is thrown again
/// on the loop.
class ThreadWorker final : public Worker {
 public:
  explicit ThreadWorker(ProcessLoop& loop);
  ~ThreadWorker() override;
  ThreadWorker(const ThreadWorker&) = delete;
  ThreadWorker& operator=(const ThreadWorker&) = delete;

  void give(Job job) override;
  std::size_t waiting() const override;
  std::optional<Overdue> overdue() const override;

 private:
  void work();

  ProcessLoop& loop_;
  mutable std::mutex mutex_;
  std::condition_variable given_;
  std::deque<std::shared_ptr<Job>> jobs_;  // the first is under way, or should be
  Utime begun_ = 0;                        // when the first job began
  bool ends_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  // read and written on the loop
  std::thread thread_;
};

}  // namespace berth
