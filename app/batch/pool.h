// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <string>
#include <vector>

#include "common/core/child_process.h"

namespace berth {

/// How a task ended.
struct TaskEnd {
  pid_t pid = 0;
  ProcessEnd process;
  double wall_s = 0;
  bool too_long = false;     ///< killed at its time limit
  bool interrupted = false;  ///< killed, as the whole batch was
  std::string error;         ///< of the exception that its body ended by; cut off where it is long
};

/// A part of a batch, in a process of its own: another program, or a copy of this one.
struct Task {
  std::vector<std::string> program;  ///< its arguments, the first the program; empty: `body`
  std::function<void()> body;        ///< what a copy of this process does; may throw
  std::filesystem::path output;      ///< what it prints is appended there; empty: nowhere
  double time_limit_s = 0;           ///< of wall time; 0: none
  bool alone = false;                ///< no other task runs at the same time
  std::function<void(const TaskEnd&)> ended;  ///< may add tasks, and throw if not interrupted
};

/// As requested; the number of processors where that is 0.
int jobs_of(int requested);

struct PoolOptions {
  int jobs = 0;                       ///< tasks at a time, by jobs_of()
  double time_budget_s = 0;           ///< of wall time, after which none begins; 0: none
  std::function<bool()> interrupted;  ///< called several times a second; may be empty
  std::function<void()> watch;        ///< called as often, for progress; may be empty
};

/// Runs the tasks of a batch, several at a time, in their order. One that crashes ends nothing but
/// itself. Not for several threads; a process that forks bodies has only one.
class Pool {
 public:
  explicit Pool(PoolOptions options);
  ~Pool();  ///< kills what still runs

  void add(Task task) { waiting_.push_back(std::move(task)); }
  void add_first(Task task) { waiting_.push_front(std::move(task)); }
  /// Until all have ended, the batch is interrupted or its time is used up; what has not begun then
  /// is dropped. What ended() throws is thrown on, and ends the batch as an interruption does.
  /// @throws InputError when a task cannot be started
  void run();
  std::size_t running() const { return running_.size(); }

 private:
  struct Running;
  bool may_begin(const Task& task) const;
  void wait() const;
  void reap();
  void interrupt();

  PoolOptions options_;
  std::deque<Task> waiting_;
  std::list<Running> running_;
};

}  // namespace berth
