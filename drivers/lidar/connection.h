// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/bus/wire.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// One end of a byte stream that carries the protocol. Never waits: what the peer does not take yet
/// is kept here, up to a bound.
class Connection {
 public:
  using OnMessage = std::function<void(const Message&)>;
  /// Called once, from the loop, when the peer is gone or does not speak the protocol; never after
  /// close() or destruction. The connection may be destroyed in either callback.
  using OnClosed = std::function<void(const std::string& reason)>;

  Connection(Loop& loop, std::unique_ptr<Wire> wire, OnMessage on_message, OnClosed on_closed);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// What both ends speak; until it is said, the newest.
  void speak(int version) { version_ = version; }
  void send(const Message& message);
  /// Why the last bytes could not be understood; empty when the stream just ended.
  const std::string& damage() const { return decoder_.error(); }

 private:
  void read();
  void flush();
  void fail(const std::string& reason);
  void release();

  Loop& loop_;
  std::unique_ptr<Wire> wire_;  // null: closed
  OnMessage on_message_;
  OnClosed on_closed_;
  int version_ = protocol_version;
  Decoder decoder_;
  std::vector<std::uint8_t> outbox_;
  Loop::TimerId retry_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth::lidar
