// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <exception>
#include <optional>
#include <string_view>

#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth::logs {

/// One message in a log. Views into the reader's file.
struct LogEvent {
  std::int64_t number = 0;  ///< counted by the logger
  Utime utime = 0;          ///< at which the logger received it
  std::string_view channel;
  Bytes data;
  std::size_t offset = 0;  ///< of its header in the file
};

/// The stock LCM log format: per event a header of 28 bytes, big-endian: sync word u32, event
/// number i64, receive time in us i64, length of channel i32, length of data i32; then channel and
/// data.
namespace format {
inline constexpr std::uint32_t sync = 0xEDA1DA01;
inline constexpr std::size_t header_bytes = 28;
inline constexpr std::size_t max_channel = 63;
}  // namespace format

/// The event as it stands in the reader's file: header, channel and data.
inline Bytes record_of(const LogEvent& event) {
  return {event.data.data() - event.channel.size() - format::header_bytes,
          format::header_bytes + event.channel.size() + event.data.size()};
}

/// The message in these bytes; nothing when they are not one of this type. Damaged length fields
/// make generated code throw: that stays here.
template <class Message>
std::optional<Message> decode(Bytes bytes) {
  try {
    Message message{};
    const int size = static_cast<int>(bytes.size());
    if (message.decode(bytes.data(), 0, size) == size) return message;
  } catch (const std::exception&) {
    // counted by the caller as undecodable
  }
  return std::nullopt;
}

/// The same of an event on this channel; nothing of an event on another one.
template <class Message>
std::optional<Message> decode(const LogEvent& event, std::string_view channel) {
  return event.channel == channel ? decode<Message>(event.data) : std::nullopt;
}

/// Decodes one message after another of a type into the same place, whose texts and lists need no
/// new memory then.
template <class Message>
class ReusedMessage {
 public:
  /// The message in these bytes, until the next one; null when they are not one of this type.
  const Message* decode(Bytes bytes) {
    try {
      const int size = static_cast<int>(bytes.size());
      return message_.decode(bytes.data(), 0, size) == size ? &message_ : nullptr;
    } catch (const std::exception&) {
      return nullptr;  // damaged length fields make generated code throw
    }
  }

 private:
  Message message_{};
};

}  // namespace berth::logs
