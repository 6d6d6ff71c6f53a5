// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/conformance_peer.h"

#include <array>

namespace berth::lidar {

ConformancePeer::ConformancePeer(ProcessLoop& loop, Socket socket)
    : loop_(loop), socket_(std::move(socket)) {
  if (connected()) loop_.watch(socket_.fd(), [this] { read(); });
}

ConformancePeer::~ConformancePeer() {
  if (connected()) loop_.unwatch(socket_.fd());
}

Utime ConformancePeer::send(const Message& message) {
  const Utime sent = loop_.now();
  send_bytes(encode(message));
  return sent;
}

void ConformancePeer::send_bytes(std::span<const std::uint8_t> bytes) {
  // A device that does not accept the bytes by then does not read.
  wait(
      [&] {
        bytes = bytes.subspan(socket_.write(bytes).value_or(bytes.size()));
        return bytes.empty();
      },
      second);
}

bool ConformancePeer::wait(const std::function<bool()>& done, Utime timeout) {
  if (done()) return true;
  bool over = false;
  const auto limit = loop_.after(timeout, [&] {
    over = true;
    loop_.stop();
  });
  // An arriving message stops the loop at once (read); the beat ends the wait without one.
  const auto beat = loop_.every(10 * millisecond, [this] { loop_.stop(); });
  while (!over && !done()) loop_.run();
  loop_.cancel(limit);
  loop_.cancel(beat);
  return done();
}

void ConformancePeer::read() {
  std::array<std::uint8_t, 65536> piece;
  const auto size = socket_.read(piece);
  const Utime at = loop_.now();
  if (!size) {
    closed_ = true;
    loop_.unwatch(socket_.fd());
  } else {
    take(std::span(piece).first(*size), at);
  }
  loop_.stop();
}

void ConformancePeer::take(std::span<const std::uint8_t> bytes, Utime at) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  decoder_.feed(bytes);
  while (const auto message = decoder_.next()) {
    const std::size_t length = static_cast<std::size_t>(bytes_[8]) | bytes_[9] << 8 |
                               bytes_[10] << 16 | static_cast<std::size_t>(bytes_[11]) << 24;
    received_.push_back({*message, bytes_[5], at});
    bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(16 + length));
  }
}

}  // namespace berth::lidar
