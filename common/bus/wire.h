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
  /// us: how long TCP waits for the answer to its first packet (RFC 6298, 2.1). Dialling again
  /// sends the next one.
  static constexpr std::int64_t dial_timeout = 1000000;

  virtual ~Wires() = default;
  /// Looks the name up and connects, without waiting; calls back with the wire, or with null where
  /// nobody listens or nobody has answered within the time-out (us).
  /// @throws InputError when the address is not of the form host:port.
  virtual void dial(const std::string& address, Connected connected,
                    std::int64_t timeout = dial_timeout) = 0;
  /// Why the address cannot be reached by any patience: its name is not known, or nobody has
  /// answered in time. Empty: nothing of the kind was seen when it was dialled last.
  virtual std::string trouble(const std::string& /*address*/) const { return {}; }
  /// Accepts connections until the Wires end.
  /// @throws InputError when the address cannot be listened on.
  virtual void listen(const std::string& address, Connected accepted) = 0;
};

}  // namespace berth
