// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/event_t.hpp>
#include <berth/node_status_t.hpp>
#include <map>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/loop.h"
#include "common/bus/worker.h"

namespace berth {

/// Setup of a node, from the program that hosts it.
struct NodeSetup {
  std::string name;                ///< "arm-driver-replica"
  std::int64_t session = 0;        ///< of the run: messages of another session move nothing
  std::string configuration_hash;  ///< SHA-256 over all files that configured it
  std::int64_t compute_delay = 0;  ///< us, in the twin: its messages leave so much later
};

/// A part of the testbed on the bus: publishes NODE_STATUS at 1 Hz and on change, HEARTBEAT at 20
/// Hz and EVENTs. Driven only by messages, timers and descriptors of its loop. It is in FAULT while
/// a job of its worker takes longer than the job's budget.
class Node {
 public:
  Node(NodeSetup setup, Bus& bus, Loop& loop);
  virtual ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  const NodeSetup& setup() const { return setup_; }

 protected:
  Bus& bus() { return bus_; }
  Loop& loop() { return loop_; }
  Utime now() const { return loop_.now(); }
  std::int64_t session() const { return setup_.session; }

  /// Maximum length of a text for the operator in an event, a reason or an answer; texts of other
  /// programs may fill a datagram. event() and report() truncate longer ones.
  static constexpr std::size_t max_characters = 2000;
  /// State is one of node_status_t::STARTING ... STOPPED. Published at once if anything changed.
  void report(std::int8_t state, const std::string& reason = "");
  /// Severity is one of event_t::INFO ... FATAL; code a stable name, text for the operator.
  void event(std::int8_t severity, const std::string& code, const std::string& text);
  /// A figure shown with the status, e.g. count("read_rate_hz", 99.8).
  void count(const std::string& name, double value) { counters_[name] = value; }
  /// Queues long work for the node's Worker.
  /// @return false when the queue is full: the job is dropped and counted as overflowed.
  bool work(Worker::Job job);
  /// A node with jobs calls it in its destructor: jobs use members that are destroyed then.
  void end_work() { worker_.reset(); }

 private:
  void publish_status();
  void watch_work();

  NodeSetup setup_;
  Bus& bus_;
  Loop& loop_;
  std::int8_t state_ = node_status_t::STARTING;
  std::string reason_;
  std::map<std::string, double> counters_;
  std::unique_ptr<Worker> worker_;  // from the first job on
  std::string overdue_;             // the job over its budget, as text; empty: none
  std::int64_t jobs_dropped_ = 0;
  std::int64_t status_seq_ = 0;
  std::int64_t heartbeat_seq_ = 0;
  std::int64_t event_seq_ = 0;
  Loop::TimerId status_timer_;
  Loop::TimerId heartbeat_timer_;
};

}  // namespace berth
