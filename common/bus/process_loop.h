// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <mutex>
#include <vector>

#include "common/bus/loop.h"

namespace berth {

/// A loop in real time for one process: poll(2) over descriptors and timers.
class ProcessLoop final : public Loop {
 public:
  /// clock_offset: microseconds to add to the monotonic clock to get Utime. The supervisor hands one
  /// to all processes of a run (environment variable BERTH_CLOCK_OFFSET_US), so that they agree and a
  /// stepped system clock changes nothing. @see clock_offset_from_environment
  explicit ProcessLoop(Utime clock_offset);
  ~ProcessLoop() override;

  Utime now() const override;
  TimerId at(Utime when, Task task) override;
  TimerId every(Utime period, Task task) override;
  void cancel(TimerId timer) override;
  void watch(int fd, Task readable) override;
  void unwatch(int fd) override;

  /// Runs until stop(). Exceptions of tasks pass through.
  void run();
  /// From any thread.
  void stop();
  /// Hands a task to the loop from any thread.
  void post(Task task);
  /// SIGINT and SIGTERM stop the loop; SIGHUP does too unless it is ignored.
  void stop_on_signals();

 private:
  struct Timer {
    TimerId id;
    Utime period;  // 0: once
    Task task;
  };

  void wake();
  void run_posted();
  void run_due_timers();
  int timeout_ms() const;

  Utime clock_offset_;
  TimerId next_id_ = 1;
  std::multimap<Utime, Timer> timers_;
  std::map<TimerId, std::multimap<Utime, Timer>::iterator> timer_of_;
  TimerId cancelled_while_running_ = 0;
  TimerId running_ = 0;
  std::map<int, Task> watched_;
  std::mutex mutex_;
  std::vector<Task> posted_;
  bool stopped_ = false;
  int wake_fd_ = -1;
  int signal_fd_ = -1;
};

/// The offset the supervisor handed out, or one taken from the system clock now.
Utime clock_offset_from_environment();
/// System clock minus monotonic clock, us.
Utime clock_offset_now();

/// Real TCP sockets on a ProcessLoop.
class TcpWires final : public Wires {
 public:
  explicit TcpWires(ProcessLoop& loop) : loop_(loop) {}
  ~TcpWires() override;
  void dial(const std::string& address, Connected connected) override;
  void listen(const std::string& address, Connected accepted) override;

 private:
  ProcessLoop& loop_;
  std::vector<int> listening_;
};

}  // namespace berth
