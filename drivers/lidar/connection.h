// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/bus/sockets.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// One end of a conversation in the protocol: its bytes on a socket in a process, its messages as
/// they are in the twin. Never waits. It is closed with its holder; called from its loop only.
class Connection {
 public:
  using OnMessage = std::function<void(const Message&)>;
  /// Called once, from the loop, when the peer is gone or does not speak the protocol (a
  /// reason can still be sent); never after destruction. The connection may be destroyed in either
  /// callback.
  using OnClosed = std::function<void(const std::string& reason)>;

  Connection() = default;
  virtual ~Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Call once, in the callback that delivered the connection.
  virtual void open(OnMessage on_message, OnClosed on_closed) = 0;
  /// Protocol version of both ends; until then the newest.
  virtual void speak(int version) = 0;
  virtual void send(const Message& message) = 0;
};

/// trouble: why there is no connection (null) and retries are in vain.
using Connected =
    std::function<void(std::unique_ptr<Connection> connection, const std::string& trouble)>;
using Accepted = std::function<void(std::unique_ptr<Connection>)>;

/// Both choose the carrier that fits the loop. Calls back from the loop.
/// @throws InputError when an address in a process is not of the form host:port.
void dial(Loop& loop, const std::string& address, Connected connected, Utime timeout);
/// Accepts until the loop ends. @throws InputError when the address cannot be listened on.
void listen(Loop& loop, const std::string& address, Accepted accepted);

/// The protocol's bytes on a socket (PROTOCOL.md). Bytes that the peer does not accept yet are
/// buffered, up to a bound.
class TcpConnection final : public Connection {
 public:
  TcpConnection(ProcessLoop& loop, Socket socket);
  ~TcpConnection() override;

  void open(OnMessage on_message, OnClosed on_closed) override;
  void speak(int version) override { version_ = version; }
  void send(const Message& message) override;
  /// Sends bytes unchanged, valid in the protocol or not.
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
