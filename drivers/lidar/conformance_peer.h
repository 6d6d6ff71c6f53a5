// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/bus/sockets.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// One connection to a device under test. Keeps every message with its type on the wire and the
/// time of its arrival. Waiting runs the loop.
class ConformancePeer {
 public:
  struct Received {
    Message message;
    std::uint8_t type = 0;
    Utime at = 0;
  };

  /// @param socket none: no connection
  ConformancePeer(ProcessLoop& loop, Socket socket);
  ~ConformancePeer();
  ConformancePeer(const ConformancePeer&) = delete;
  ConformancePeer& operator=(const ConformancePeer&) = delete;

  bool connected() const { return socket_.fd() >= 0; }
  /// The device has closed the connection.
  bool closed() const { return closed_; }
  /// Error of the protocol decoder; empty: none.
  const std::string& damage() const { return decoder_.error(); }
  const std::vector<Received>& received() const { return received_; }

  /// @return when it was sent.
  Utime send(const Message& message);
  void send_bytes(std::span<const std::uint8_t> bytes);
  /// @return done(), no later than after the time-out.
  bool wait(const std::function<bool()>& done, Utime timeout);
  /// The first message of its kind from index `from` of received() on.
  template <class Kind>
  std::optional<Received> find(std::size_t from) const {
    for (std::size_t i = from; i < received_.size(); ++i) {
      if (std::holds_alternative<Kind>(received_[i].message)) return received_[i];
    }
    return std::nullopt;
  }
  template <class Kind>
  std::optional<Received> await(std::size_t from, Utime timeout) {
    wait([&] { return closed_ || find<Kind>(from).has_value(); }, timeout);
    return find<Kind>(from);
  }

 private:
  void read();
  void take(std::span<const std::uint8_t> bytes, Utime at);

  ProcessLoop& loop_;
  Socket socket_;
  bool closed_ = false;
  std::vector<std::uint8_t> bytes_;  // not decoded yet
  Decoder decoder_;
  std::vector<Received> received_;
};

}  // namespace berth::lidar
