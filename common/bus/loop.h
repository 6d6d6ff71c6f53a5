// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace berth {

/// Microseconds since the epoch, on the clock that all nodes of a run share.
using Utime = std::int64_t;
constexpr Utime millisecond = 1000;
constexpr Utime second = 1000000;
constexpr double seconds(Utime t) { return static_cast<double>(t) * 1e-6; }
inline Utime utime_from_seconds(double s) { return static_cast<Utime>(std::llround(s * 1e6)); }

class Worker;

/// The thread on which a node's code runs, with its clock and timers. What takes long runs on a
/// Worker, so that heartbeats, supervision and stops never wait. Two kinds: ProcessLoop (real time)
/// and SimulatedLoop (the twin). Other threads may call now() and stopwatch() only.
class Loop {
 public:
  using Task = std::function<void()>;
  using TimerId = std::uint64_t;

  virtual ~Loop() = default;

  virtual Utime now() const = 0;
  /// Runs the task once, not before `when`.
  virtual TimerId at(Utime when, Task task) = 0;
  TimerId after(Utime delay, Task task) { return at(now() + delay, std::move(task)); }
  /// Runs the task every period, first one period from now. A late loop skips beats: it never
  /// makes up for them in a burst.
  virtual TimerId every(Utime period, Task task) = 0;
  /// Of a timer that fired or was cancelled: does nothing.
  virtual void cancel(TimerId timer) = 0;

  /// For work that takes long. It must end before this loop.
  virtual std::unique_ptr<Worker> make_worker() = 0;

  /// How long work takes: in real time a steady clock in microseconds; in the twin the simulated
  /// clock, so that nothing measured enters its log.
  virtual Utime stopwatch() const { return now(); }
};

}  // namespace berth
