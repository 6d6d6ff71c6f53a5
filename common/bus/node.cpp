// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/node.h"

#include <berth/heartbeat_t.hpp>

#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "common/core/version.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

/// As many as the longest queue of the bus.
constexpr std::size_t max_jobs_waiting = 4000;

}  // namespace

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
    watch_work();
  });
}

Node::~Node() {
  loop_.cancel(status_timer_);
  loop_.cancel(heartbeat_timer_);
}

void Node::report(std::int8_t state, const std::string& reason) {
  const std::string_view shown = first_columns(reason, max_characters);
  if (state == state_ && shown == reason_) return;
  state_ = state;
  reason_ = shown;
  publish_status();
}

bool Node::work(Worker::Job job) {
  if (!worker_) worker_ = loop_.make_worker();
  if (worker_->waiting() >= max_jobs_waiting) {
    ++jobs_dropped_;
    return false;
  }
  worker_->give(std::move(job));
  return true;
}

void Node::watch_work() {
  if (!worker_) return;
  const auto late = worker_->overdue();
  const std::string words = late ? late->name + " takes longer than its budget of " +
                                       fixed(seconds(late->budget), 1) + " s"
                                 : "";
  if (words == overdue_) return;
  if (late) {
    event(event_t::ERROR, "work-overdue", words);
  } else {
    event(event_t::NOTICE, "work-ended", "at its end: " + overdue_);
  }
  overdue_ = words;
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
  event.text = first_columns(text, max_characters);
  bus_.publish(channels::event, event);
}

void Node::publish_status() {
  node_status_t status{};
  status.utime = now();
  status.seq = ++status_seq_;
  status.session = session();
  status.node = setup_.name;
  status.state = overdue_.empty() ? state_ : node_status_t::FAULT;
  status.reason = overdue_.empty() ? reason_ : overdue_;
  status.version = version();
  status.configuration_hash = setup_.configuration_hash;
  const BusCounters counters = bus_.counters();
  status.received = counters.received;
  status.published = counters.published;
  status.undecodable = counters.undecodable;
  status.overflowed = counters.overflowed + jobs_dropped_;
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
