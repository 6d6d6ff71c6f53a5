// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/connection.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace berth::lidar {
namespace {

constexpr std::size_t outbox_limit = 8 << 20;
constexpr Utime retry_period = 2 * millisecond;

}  // namespace

Connection::Connection(Loop& loop, int fd, OnMessage on_message, OnClosed on_closed)
    : loop_(loop), fd_(fd), on_message_(std::move(on_message)), on_closed_(std::move(on_closed)) {
  loop_.watch(fd_, [this] { read(); });
}

Connection::~Connection() {
  *alive_ = false;
  release();
}

void Connection::release() {
  if (fd_ < 0) return;
  loop_.cancel(retry_);
  loop_.unwatch(fd_);
  ::close(fd_);
  fd_ = -1;
}

void Connection::fail(const std::string& reason) {
  if (fd_ < 0) return;
  release();
  // Not from within send(): its caller may be in the midst of something.
  loop_.after(0, [this, reason, alive = alive_] {
    if (*alive) on_closed_(reason);
  });
}

void Connection::read() {
  std::uint8_t bytes[16384];
  const auto alive = alive_;
  while (fd_ >= 0) {
    const ssize_t size = ::recv(fd_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (size < 0) return fail(std::strerror(errno));
    if (size == 0) return fail("the peer closed the connection");
    decoder_.feed({bytes, static_cast<std::size_t>(size)});
    while (const auto message = decoder_.next()) {
      on_message_(*message);
      if (!*alive || fd_ < 0) return;
    }
    if (decoder_.broken()) return fail(decoder_.error());
    if (static_cast<std::size_t>(size) < sizeof bytes) return;  // that was all there is
  }
}

void Connection::send(const Message& message) {
  if (fd_ < 0) return;
  const auto bytes = encode(message);
  outbox_.insert(outbox_.end(), bytes.begin(), bytes.end());
  flush();
}

void Connection::flush() {
  loop_.cancel(retry_);
  while (!outbox_.empty()) {
    const ssize_t size = ::send(fd_, outbox_.data(), outbox_.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      if (outbox_.size() > outbox_limit) return fail("the peer does not read");
      retry_ = loop_.after(retry_period, [this] { flush(); });
      return;
    }
    if (size < 0) return fail(std::strerror(errno));
    outbox_.erase(outbox_.begin(), outbox_.begin() + size);
  }
}

}  // namespace berth::lidar
