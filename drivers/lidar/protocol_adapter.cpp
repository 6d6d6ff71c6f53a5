// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/protocol_adapter.h"

namespace berth::lidar {

ProtocolAdapter::ProtocolAdapter(ProtocolSettings settings, Loop& loop)
    : settings_(std::move(settings)), loop_(loop), reason_("not connected yet") {}

void ProtocolAdapter::start(Events events) {
  events_ = std::move(events);
  poll_timer_ = loop_.every(settings_.status_period, [this] { poll(); });
  redial_timer_ = loop_.after(0, [this] { dial(); });
}

ProtocolAdapter::~ProtocolAdapter() {
  *alive_ = false;
  loop_.cancel(poll_timer_);
  loop_.cancel(redial_timer_);
}

void ProtocolAdapter::dial() {
  lidar::dial(
      loop_, settings_.address,
      [this, alive = alive_](std::unique_ptr<Connection> connection, const std::string& trouble) {
        if (*alive) connected(std::move(connection), trouble);
      },
      settings_.dial_timeout);
}

void ProtocolAdapter::connected(std::unique_ptr<Connection> connection,
                                const std::string& trouble) {
  if (!connection) {
    return drop(trouble.empty() ? "no answer from " + settings_.address : trouble);
  }
  last_received_ = loop_.now();
  connection_ = std::move(connection);
  connection_->open([this](const Message& message) { receive(message); },
                    [this](const std::string& reason) { hung_up(reason); });
  connection_->send(Hello{version_});
}

/// The device closed the connection, or is about to.
void ProtocolAdapter::hung_up(const std::string& reason) {
  if (greeted_ || version_ == 1) return drop(reason);
  version_ = 1;
  connection_.reset();
  dial();
}

void ProtocolAdapter::drop(const std::string& reason) {
  const bool news = ready_ || reason != reason_;
  connection_.reset();
  greeted_ = false;
  ready_ = false;
  scanning_ = false;
  clock_.clear();
  queries_.clear();
  version_ = protocol_version;
  reason_ = reason;
  loop_.cancel(redial_timer_);
  redial_timer_ = loop_.after(settings_.redial, [this] { dial(); });
  if (news) events_.lost(reason);
}

void ProtocolAdapter::send(const Message& message) {
  if (connection_) connection_->send(message);
}

void ProtocolAdapter::order(const ScanOrder& order) {
  scanning_ = true;
  scan_news_ = loop_.now();
  send(order);
}

void ProtocolAdapter::follow_scan(const Message& message) {
  const auto* answer = std::get_if<ScanAnswer>(&message);
  const bool refused = answer != nullptr && !answer->accepted;
  if (refused || std::holds_alternative<ScanEnd>(message)) scanning_ = false;
  if (!std::holds_alternative<Status>(message)) scan_news_ = loop_.now();
}

void ProtocolAdapter::poll() {
  if (!connection_) return;
  if (scanning_ && loop_.now() - scan_news_ > settings_.returns_silence) {
    return drop("no returns of a running scan for " +
                std::to_string(settings_.returns_silence / millisecond) + " ms");
  }
  if (loop_.now() - last_received_ > settings_.silence) {
    return drop("nothing received from the LIDAR for " +
                std::to_string(settings_.silence / second) + " s");
  }
  if (!greeted_) return;
  queries_[++token_] = loop_.now();
  connection_->send(StatusQuery{token_});
}

void ProtocolAdapter::receive(const Message& message) {
  last_received_ = loop_.now();
  if (const auto* identity = std::get_if<Identity>(&message)) return greet(*identity);
  if (const auto* complaint = std::get_if<Complaint>(&message)) {
    return hung_up("the LIDAR complains: " + complaint->reason);
  }
  if (const auto* status = std::get_if<Status>(&message)) read_clock(*status);
  follow_scan(message);
  if (ready_) events_.message(message);
}

void ProtocolAdapter::greet(const Identity& identity) {
  if (identity.version < 1 || identity.version > version_) {
    return drop("the LIDAR speaks version " + std::to_string(identity.version) +
                " of the protocol, expected 1 to " + std::to_string(version_));
  }
  if (identity.model != settings_.model) {
    return drop("the LIDAR is a '" + identity.model + "', expected '" + settings_.model + "'");
  }
  identity_ = identity;
  greeted_ = true;
  poll();
}

void ProtocolAdapter::read_clock(const Status& status) {
  const auto query = queries_.find(status.token);
  if (query == queries_.end()) return;
  clock_.add(query->second, status.device_time, loop_.now());
  queries_.erase(queries_.begin(), std::next(query));
  if (ready_) return;
  ready_ = true;
  reason_.clear();
  events_.ready();
}

}  // namespace berth::lidar
