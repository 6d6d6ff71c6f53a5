// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/node.h"

#include <berth/heartbeat_t.hpp>

#include "common/core/version.h"
#include "lcmtypes/channels.h"

namespace berth {

Node::Node(NodeSetup setup, Bus& bus, Loop& loop)
    : setup_(std::move(setup)), bus_(bus), loop_(loop) {
  status_timer_ = loop_.every(second, [this] { publish_status(); });
  heartbeat_timer_ = loop_.every(50 * millisecond, [this] {
    heartbeat_t beat{};
    beat.utime = now();
    beat.seq = ++heartbeat_seq_;
    beat.session = session();
    beat.node = setup_.name;
    bus_.publish(channels::heartbeat, beat);
  });
}

Node::~Node() {
  loop_.cancel(status_timer_);
  loop_.cancel(heartbeat_timer_);
}

void Node::report(std::int8_t state, const std::string& reason) {
  if (state == state_ && reason == reason_) return;
  state_ = state;
  reason_ = reason;
  publish_status();
}

void Node::event(std::int8_t severity, const std::string& code, const std::string& text) {
  event_t event{};
  event.utime = now();
  event.seq = ++event_seq_;
  event.session = session();
  event.node = setup_.name;
  event.severity = severity;
  event.code = code;
  event.text = text;
  bus_.publish(channels::event, event);
}

void Node::publish_status() {
  node_status_t status{};
  status.utime = now();
  status.seq = ++status_seq_;
  status.session = session();
  status.node = setup_.name;
  status.state = state_;
  status.reason = reason_;
  status.version = version();
  status.configuration_hash = setup_.configuration_hash;
  const BusCounters counters = bus_.counters();
  status.received = counters.received;
  status.published = counters.published;
  status.undecodable = counters.undecodable;
  status.overflowed = counters.overflowed;
  status.superseded = counters.superseded;
  if (counters.unsent > 0) count("unsent", static_cast<double>(counters.unsent));
  for (const auto& [name, value] : counters_) {
    counter_t counter{};
    counter.name = name;
    counter.value = value;
    status.counters.push_back(counter);
  }
  status.counter_count = static_cast<std::int32_t>(status.counters.size());
  bus_.publish(channels::node_status, status);
}

}  // namespace berth
