// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/heartbeat_t.hpp>
#include <berth/node_status_t.hpp>
#include <berth/precondition_t.hpp>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/bus/loop.h"

namespace berth::procedures {

/// The nodes that must be ready to start and to go on.
class NodeWatch {
 public:
  /// supervisor: of the nodes, the one whose FAULT is final; empty: none. outside: text for nodes
  /// that the user starts, until their first message.
  NodeWatch(const std::vector<std::string>& required, std::string supervisor,
            const std::map<std::string, std::string>& outside = {});

  void start(Utime now);
  void on(const node_status_t& message);
  void on(const heartbeat_t& message, Utime now);

  bool requires_node(const std::string& name) const { return nodes_.count(name) != 0; }
  /// Nodes that are not ready, with their states: "testbed (STARTING), ..."; empty: all are.
  std::string missing() const;
  /// The same while they start, with their reasons: "lidar-driver, testbed (no IK)".
  std::string awaited() const;
  /// The fault that makes waiting for them useless; empty: none.
  std::string final_fault() const;
  /// A node in fault or silent for longer than the timeout; empty: none. excused: a node whose
  /// fault is ignored.
  std::string trouble(Utime now, Utime heartbeat_timeout, const std::string& excused) const;
  /// One for each node.
  std::vector<precondition_t> preconditions(bool going_on) const;

 private:
  struct Node {
    std::int8_t state = node_status_t::STARTING;
    std::string reason;
    bool received = false;
    Utime heartbeat = 0;

    bool ready() const;
    std::string text() const;
  };
  std::string not_ready(const std::function<std::string(const Node&)>& remark) const;

  std::map<std::string, Node> nodes_;
  std::string supervisor_;
};

}  // namespace berth::procedures
