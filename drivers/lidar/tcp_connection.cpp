// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/tcp_connection.h"

#include <array>

namespace berth::lidar {
namespace {

constexpr std::size_t outbox_limit = 8 << 20;
constexpr Utime retry_period = 2 * millisecond;

}  // namespace

TcpConnection::TcpConnection(ProcessLoop& loop, Socket socket)
    : loop_(loop), socket_(std::move(socket)) {}

TcpConnection::~TcpConnection() {
  *alive_ = false;
  loop_.cancel(retry_);
  loop_.unwatch(socket_.fd());
}

void TcpConnection::open(OnMessage on_message, OnClosed on_closed) {
  on_message_ = std::move(on_message);
  on_closed_ = std::move(on_closed);
  loop_.watch(socket_.fd(), [this] { read(); });
}

void TcpConnection::fail(const std::string& reason) {
  if (over_) return;
  over_ = true;
  loop_.cancel(retry_);
  loop_.unwatch(socket_.fd());
  // Not from within send(): its caller may be in the midst of something.
  loop_.after(0, [this, reason, alive = alive_] {
    if (*alive) on_closed_(reason);
  });
}

void TcpConnection::read() {
  std::array<std::uint8_t, 16384> bytes;
  const auto alive = alive_;
  while (true) {
    const auto size = socket_.read(bytes);
    if (!size) return fail("the peer closed the connection");
    decoder_.feed(std::span(bytes).first(*size));
    while (const auto message = decoder_.next()) {
      on_message_(*message);
      if (!*alive || over_) return;
    }
    if (decoder_.broken()) return fail(decoder_.error());
    if (*size < bytes.size()) return;  // that was all there is
  }
}

void TcpConnection::send(const Message& message) { send_bytes(encode(message, version_)); }

void TcpConnection::send_bytes(std::span<const std::uint8_t> bytes) {
  outbox_.insert(outbox_.end(), bytes.begin(), bytes.end());
  flush();
}

void TcpConnection::flush() {
  loop_.cancel(retry_);
  const auto taken = socket_.write(outbox_);
  if (!taken) return fail("the peer closed the connection");
  outbox_.erase(outbox_.begin(), outbox_.begin() + static_cast<std::ptrdiff_t>(*taken));
  if (outbox_.empty() || over_) return;
  if (outbox_.size() > outbox_limit) return fail("the peer does not read");
  retry_ = loop_.after(retry_period, [this] { flush(); });
}

}  // namespace berth::lidar
