// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>

#include "common/bus/bus.h"

namespace berth::logs {

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
