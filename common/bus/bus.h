// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace berth {

/// How messages wait for a busy node.
struct Queue {
  /// A mailbox of one: states that feed control. A message replaced before it was handled is
  /// counted as superseded.
  static Queue latest() { return {0}; }
  /// A bounded queue: packets, commands, events. A message that does not fit is counted as
  /// overflowed.
  static Queue fifo(std::size_t capacity = 1000) { return {capacity}; }
  std::size_t capacity;
};

struct BusCounters {
  std::int64_t received = 0;
  std::int64_t published = 0;
  std::int64_t unsent = 0;  ///< of these, refused by the network
  std::int64_t undecodable = 0;
  std::int64_t overflowed = 0;
  std::int64_t superseded = 0;
};

/// The bytes of a message, valid during the call.
using Bytes = std::span<const std::uint8_t>;

/// One node's end of the bus. Handlers run on the node's loop. Subscribe before the loop runs.
/// Undecodable messages are counted and never reach a handler.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Encodes and sends. Messages of at most 60 kB: one datagram.
  /// @throws std::length_error for a larger one, which is a bug of the caller.
  template <class Message>
  void publish(const std::string& channel, const Message& message) {
    const int size = message.getEncodedSize();
    buffer_.resize(static_cast<std::size_t>(size));
    if (size > max_message_bytes || message.encode(buffer_.data(), 0, size) != size) {
      throw std::length_error(channel + ": a message of " + std::to_string(size) +
                              " bytes cannot be sent");
    }
    ++counters_.published;
    send(channel, buffer_);
  }

  template <class Message>
  void subscribe(const std::string& channel, Queue queue,
                 std::function<void(const Message&)> handler) {
    receive(channel, queue, [this, handler = std::move(handler)](Bytes bytes) {
      Message message{};
      if (decode(bytes, message)) {
        handler(message);
      } else {
        ++counters_.undecodable;
      }
    });
  }

  virtual BusCounters counters() const { return counters_; }

  static constexpr int max_message_bytes = 60000;

 protected:
  using RawHandler = std::function<void(Bytes)>;
  virtual void send(const std::string& channel, Bytes bytes) = 0;
  virtual void receive(const std::string& channel, Queue queue, RawHandler handler) = 0;

  BusCounters counters_;

 private:
  /// A damaged length field makes generated code throw or allocate memory: no such exception leaves
  /// this.
  template <class Message>
  static bool decode(Bytes bytes, Message& message) {
    try {
      const int size = static_cast<int>(bytes.size());
      return message.decode(bytes.data(), 0, size) == size;
    } catch (const std::exception&) {
      return false;
    }
  }

  std::vector<std::uint8_t> buffer_;
};

}  // namespace berth
