// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/node_watch.h"

#include "lcmtypes/words.h"

namespace berth::procedures {

bool NodeWatch::Node::ready() const {
  return state == node_status_t::READY || state == node_status_t::RUNNING;
}

std::string NodeWatch::Node::text() const {
  return (received ? words::of_node_state(state) : "nothing received") +
         (reason.empty() ? "" : ": " + reason);
}

NodeWatch::NodeWatch(const std::vector<std::string>& required, std::string supervisor,
                     const std::map<std::string, std::string>& outside)
    : supervisor_(std::move(supervisor)) {
  for (const std::string& name : required) nodes_[name] = {};
  for (const auto& [name, how] : outside) nodes_[name].reason = how;
}

void NodeWatch::start(Utime now) {
  for (auto& [name, node] : nodes_) node.heartbeat = now;
}

void NodeWatch::on(const node_status_t& message) {
  const auto node = nodes_.find(message.node);
  if (node == nodes_.end()) return;
  node->second.received = true;
  node->second.state = message.state;
  node->second.reason = message.reason;
}

void NodeWatch::on(const heartbeat_t& message, Utime now) {
  const auto node = nodes_.find(message.node);
  if (node != nodes_.end()) node->second.heartbeat = now;
}

std::string NodeWatch::not_ready(const std::function<std::string(const Node&)>& remark) const {
  std::string list;
  for (const auto& [name, node] : nodes_) {
    if (node.ready()) continue;
    const std::string about = remark(node);
    list += (list.empty() ? "" : ", ") + name + (about.empty() ? "" : " (" + about + ")");
  }
  return list;
}

std::string NodeWatch::missing() const {
  return not_ready([](const Node& node) { return node.text(); });
}

std::string NodeWatch::awaited() const {
  return not_ready([](const Node& node) { return node.reason; });
}

std::string NodeWatch::final_fault() const {
  const auto supervisor = nodes_.find(supervisor_);
  const bool fault = supervisor != nodes_.end() && supervisor->second.state == node_status_t::FAULT;
  return fault ? supervisor->second.reason : "";
}

std::string NodeWatch::trouble(Utime now, Utime heartbeat_timeout,
                               const std::string& excused) const {
  for (const auto& [name, node] : nodes_) {
    const bool fault = node.state == node_status_t::FAULT && name != excused;
    if (fault || node.state == node_status_t::STOPPED) {
      return "node " + name + ": " + node.text();
    }
    if (now - node.heartbeat > heartbeat_timeout) return "node " + name + " is silent";
  }
  return {};
}

std::vector<precondition_t> NodeWatch::preconditions(bool going_on) const {
  std::vector<precondition_t> list;
  for (const auto& [name, node] : nodes_) {
    precondition_t item;
    item.name = "node " + name;
    // a node on hold is DEGRADED; the testbed's own state is checked as well
    const bool held = going_on && node.state == node_status_t::DEGRADED;
    item.met = node.received && (node.ready() || held);
    item.reason = node.text();
    list.push_back(item);
  }
  return list;
}

}  // namespace berth::procedures
