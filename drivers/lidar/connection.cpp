// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/connection.h"

#include <array>

namespace berth::lidar {
namespace {

constexpr std::size_t outbox_limit = 8 << 20;
constexpr Utime retry_period = 2 * millisecond;

}  // namespace

Connection::Connection(Loop& loop, std::unique_ptr<Wire> wire, OnMessage on_message,
                       OnClosed on_closed)
    : loop_(loop),
      wire_(std::move(wire)),
      on_message_(std::move(on_message)),
      on_closed_(std::move(on_closed)) {
  wire_->watch([this] { read(); });
}

Connection::~Connection() {
  *alive_ = false;
  release();
}

void Connection::release() {
  if (!wire_) return;
  loop_.cancel(retry_);
  wire_.reset();
}

void Connection::fail(const std::string& reason) {
  if (!wire_) return;
  release();
  // Not from within send(): its caller may be in the midst of something.
  loop_.after(0, [this, reason, alive = alive_] {
    if (*alive) on_closed_(reason);
  });
}

void Connection::read() {
  std::array<std::uint8_t, 16384> bytes;
  const auto alive = alive_;
  while (wire_) {
    const auto size = wire_->read(bytes);
    if (!size) return fail("the peer closed the connection");
    decoder_.feed(std::span(bytes).first(*size));
    while (const auto message = decoder_.next()) {
      on_message_(*message);
      if (!*alive || !wire_) return;
    }
    if (decoder_.broken()) return fail(decoder_.error());
    if (*size < bytes.size()) return;  // that was all there is
  }
}

void Connection::send(const Message& message) {
  if (!wire_) return;
  const auto bytes = encode(message, version_);
  outbox_.insert(outbox_.end(), bytes.begin(), bytes.end());
  flush();
}

void Connection::flush() {
  loop_.cancel(retry_);
  const auto taken = wire_->write(outbox_);
  if (!taken) return fail("the peer closed the connection");
  outbox_.erase(outbox_.begin(), outbox_.begin() + static_cast<std::ptrdiff_t>(*taken));
  if (outbox_.empty()) return;
  if (outbox_.size() > outbox_limit) return fail("the peer does not read");
  retry_ = loop_.after(retry_period, [this] { flush(); });
}

}  // namespace berth::lidar
