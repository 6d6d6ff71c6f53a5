// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/sockets.h"
#include "drivers/lidar/connection.h"

namespace berth::lidar {

/// The protocol's bytes on a socket (PROTOCOL.md). What the peer does not take yet is kept here, up
/// to a bound.
class TcpConnection final : public Connection {
 public:
  TcpConnection(ProcessLoop& loop, Socket socket);
  ~TcpConnection() override;

  void open(OnMessage on_message, OnClosed on_closed) override;
  void speak(int version) override { version_ = version; }
  void send(const Message& message) override;
  /// Bytes as they are, whether the protocol has them or not.
  void send_bytes(std::span<const std::uint8_t> bytes);

 private:
  void read();
  void flush();
  void fail(const std::string& reason);

  ProcessLoop& loop_;
  Socket socket_;
  bool over_ = false;  // on_closed_ is due or has been called
  OnMessage on_message_;
  OnClosed on_closed_;
  int version_ = protocol_version;
  Decoder decoder_;
  std::vector<std::uint8_t> outbox_;
  Loop::TimerId retry_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth::lidar
