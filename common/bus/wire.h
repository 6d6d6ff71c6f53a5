// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace berth {

/// One end of a byte stream between a driver and its device. Nothing here waits. It is closed with
/// its holder; whoever calls, calls from the loop that its Wires belong to.
class Wire {
 public:
  using Readable = std::function<void()>;

  virtual ~Wire() = default;
  /// @return how many bytes have come and were taken; 0 when there are none now; nothing when the
  /// peer is gone and all it said has been read.
  virtual std::optional<std::size_t> read(std::span<std::uint8_t> into) = 0;
  /// @return how many of the bytes were taken, fewer when the peer does not read; nothing when it
  /// is gone.
  virtual std::optional<std::size_t> write(std::span<const std::uint8_t> bytes) = 0;
  /// Calls readable for as long as there are bytes to be read or the peer is gone; it may destroy
  /// the wire.
  virtual void watch(Readable readable) = 0;
  virtual void unwatch() = 0;
};

/// Makes a node's wires to devices. Addresses are "host:port". Sockets in a process (TcpWires),
/// memory in the twin, and the same bytes through both.
class Wires {
 public:
  using Connected = std::function<void(std::unique_ptr<Wire>)>;

  virtual ~Wires() = default;
  /// Connects without waiting; calls back with the wire, or with null where nobody listens.
  virtual void dial(const std::string& address, Connected connected) = 0;
  /// Accepts connections until the Wires end.
  /// @throws InputError when the address cannot be listened on.
  virtual void listen(const std::string& address, Connected accepted) = 0;
};

}  // namespace berth
