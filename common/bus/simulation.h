// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <typeindex>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth {

class SimulatedLoop;

/// Pending events of a Simulation, ordered by time and, at equal times, by order of insertion.
class EventQueue {
 public:
  struct Event {
    SimulatedLoop* loop = nullptr;  ///< null: of the simulation itself
    Utime period = 0;               ///< 0: once
    Loop::Task task;
  };

  /// @return its name for cancel(), never 0
  Loop::TimerId add(Utime when, Event event);
  /// No effect on an event that is over or cancelled.
  void cancel(Loop::TimerId timer);
  /// When the next event is due; nothing: there is none.
  std::optional<Utime> next();
  /// Takes the next event out. One that repeats stays, a period later. Only after next() named one.
  Event take();

 private:
  struct Slot {
    Event event;
    std::uint32_t uses = 1;  // incremented when the slot is freed: invalidates its former names
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

class SimulatedLoop;
class SimulatedBus;

/// The twin's world of events: one clock that advances from event to event, one thread,
/// reproducible to the bit. Every node has its own SimulatedLoop and SimulatedBus, which live as
/// long as the Simulation. Destroy nodes after the last event only.
class Simulation {
 public:
  struct Options {
    Utime start = 1735689600 * second;  ///< 2025-01-01T00:00:00Z
    Utime wire_latency = 200;           ///< us from sent to received, between driver and device
    Utime bus_latency = 100;            ///< us from publish to handler
    double bus_loss = 0;                ///< 0..1: share of the packets that a receiver never gets
    std::uint64_t loss_seed = 1;
  };

  Simulation() : Simulation(Options{}) {}
  explicit Simulation(Options options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  Utime now() const { return now_; }
  /// Runs events up to and including this time.
  void run_until(Utime end);
  void run_for(Utime duration) { run_until(now_ + duration); }
  /// Runs until done() is true after an event, or the time limit passes. @return done().
  bool run_until(const std::function<bool()>& done, Utime limit);

  SimulatedLoop& make_loop();
  /// Messages published on this bus leave after compute_delay, the duration of the node's
  /// computation.
  SimulatedBus& make_bus(Utime compute_delay = 0);

  /// As SIGSTOP does to a process: the node's code no longer runs. Incoming messages wait,
  /// connections stay open.
  void stop(SimulatedLoop& loop, SimulatedBus& bus);
  /// As SIGCONT: waiting messages are delivered at once, in their order; timers skip the beats they
  /// missed.
  void go_on(SimulatedLoop& loop, SimulatedBus& bus);
  /// As an endless loop in the node's worker: its jobs wait, while its loop goes on.
  void stop_work(SimulatedLoop& loop);
  /// Waiting jobs run at once, in their order.
  void go_on_with_work(SimulatedLoop& loop);
  /// As SIGKILL, once the node is destroyed: nothing is delivered to it any more.
  void kill(SimulatedLoop& loop, SimulatedBus& bus);
  /// Loss of the packets sent from now on.
  void set_bus_loss(double share);

  /// Receives every message, lost ones included, in order, at the time of its delivery.
  using Recorder = std::function<void(Utime, const std::string& channel, Bytes)>;
  void record(Recorder recorder);

  Utime wire_latency() const;

  /// The one object of its type, made at the first call: state that drivers and devices of the
  /// twin share apart from the bus.
  template <class T>
  T& shared() {
    std::shared_ptr<void>& object = shared_[typeid(T)];
    if (!object) object = std::make_shared<T>();
    return *static_cast<T*>(object.get());
  }

 private:
  friend class SimulatedLoop;
  friend class SimulatedBus;
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::map<std::type_index, std::shared_ptr<void>> shared_;
  Utime now_;
};

class SimulatedLoop final : public Loop {
 public:
  Simulation& simulation() { return simulation_; }
  Utime now() const override;
  TimerId at(Utime when, Task task) override;
  TimerId every(Utime period, Task task) override;
  void cancel(TimerId timer) override;
  /// Runs each job within give(), in no simulated time, unless Simulation::stop_work was called.
  std::unique_ptr<Worker> make_worker() override;

 private:
  friend class Simulation;
  class InlineWorker;
  explicit SimulatedLoop(Simulation& simulation) : simulation_(simulation) {}
  Simulation& simulation_;
  bool stopped_ = false;
  std::vector<Task> waiting_;
  bool work_stopped_ = false;
  std::vector<InlineWorker*> workers_;
};

/// Handlers run inline, in the order of subscription: no queue can overflow.
class SimulatedBus final : public Bus {
 protected:
  void send(const std::string& channel, Bytes bytes) override;
  void receive(const std::string& channel, Queue queue, RawHandler handler) override;

 private:
  friend class Simulation;
  SimulatedBus(Simulation& simulation, Utime compute_delay)
      : simulation_(simulation), compute_delay_(compute_delay) {}
  Simulation& simulation_;
  Utime compute_delay_;
  bool stopped_ = false;
  std::vector<std::function<void()>> waiting_;
};

}  // namespace berth
