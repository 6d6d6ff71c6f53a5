// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "common/bus/loop.h"

namespace berth {

class SimulatedLoop;

/// What a Simulation has still to run: by time, and of one time in the order it was asked for.
class EventQueue {
 public:
  struct Event {
    SimulatedLoop* loop = nullptr;  ///< null: of the simulation itself
    Utime period = 0;               ///< 0: once
    Loop::Task task;
  };

  /// @return its name for cancel(), never 0
  Loop::TimerId add(Utime when, Event event);
  /// Of one that is over or cancelled: does nothing.
  void cancel(Loop::TimerId timer);
  /// When the next event is due; nothing: there is none.
  std::optional<Utime> next();
  /// Takes the next event out. One that repeats stays, a period later. Only after next() named one.
  Event take();

 private:
  struct Slot {
    Event event;
    std::uint32_t uses = 1;  // one more when it is free again: names of its past mean nothing
  };
  struct Entry {
    Utime when;
    std::uint64_t order;
    std::uint32_t slot;
    std::uint32_t uses;
  };

  struct Later {
    bool operator()(const Entry& a, const Entry& b) const {
      return a.when != b.when ? a.when > b.when : a.order > b.order;
    }
  };

  void push(Utime when, std::uint32_t slot);
  void pop();
  void release(std::uint32_t slot);

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::vector<Entry> heap_;  // the next in front; those of cancelled events stay until they are due
  std::uint64_t order_ = 0;
};

}  // namespace berth
