// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "common/bus/loop.h"

namespace berth {

class Sockets;

/// A loop in real time for one process: ppoll(2) over descriptors and timers.
class ProcessLoop final : public Loop {
 public:
  /// clock_offset: microseconds to add to the monotonic clock to get Utime. The supervisor hands
  /// one to all processes of a run, so that they agree and a stepped system clock changes nothing.
  /// @see clock_offset_from_environment
  explicit ProcessLoop(Utime clock_offset);
  ~ProcessLoop() override;
  ProcessLoop(const ProcessLoop&) = delete;
  ProcessLoop& operator=(const ProcessLoop&) = delete;

  Utime now() const override;
  TimerId at(Utime when, Task task) override;
  TimerId every(Utime period, Task task) override;
  void cancel(TimerId timer) override;
  /// TCP connections to the node's devices.
  Sockets& sockets() { return *sockets_; }
  /// A thread of its own.
  std::unique_ptr<Worker> make_worker() override;
  /// Calls readable whenever the descriptor has input or its peer is gone, until unwatch.
  void watch(int fd, Task readable);
  /// Calls writable when the descriptor takes output; replaces a watch for input.
  void watch_writable(int fd, Task writable);
  void unwatch(int fd);

  /// Runs until stop(). Exceptions of tasks pass through.
  void run();
  /// From any thread.
  void stop();
  /// Hands a task to the loop from any thread.
  void post(Task task);
  /// Calls handler for SIGINT and SIGTERM, on the loop. Call before other threads start.
  void on_signals(std::function<void(int)> handler);
  void stop_on_signals() {
    on_signals([this](int) { stopped_ = true; });
  }

 private:
  struct Timer {
    TimerId id;
    Utime period;  // 0: once
    Task task;
  };
  using Timers = std::multimap<Utime, Timer>;
  struct Watch {
    short events;
    std::shared_ptr<Task> task;
  };

  TimerId add(Utime when, Utime period, Task task);
  void wake();
  void run_posted();
  void run_due_timers();

  Utime clock_offset_;
  TimerId next_id_ = 1;
  Timers timers_;
  std::unordered_map<TimerId, Timers::iterator> timer_of_;
  std::map<int, Watch> watched_;
  std::mutex mutex_;
  std::vector<Task> posted_;
  bool stopped_ = false;
  std::unique_ptr<Sockets> sockets_;
  int wake_fd_ = -1;
  int signal_fd_ = -1;
};

/// The offset the supervisor handed out in BERTH_CLOCK_OFFSET_US, or one taken from the system
/// clock.
Utime clock_offset_from_environment();
/// System clock minus monotonic clock, us.
Utime clock_offset_now();

}  // namespace berth
