// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/frames.h"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

namespace berth {

bool ModbusFrames::fill(int fd) {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  const ssize_t got = recv(fd, buffer_.data() + end_, buffer_.size() - end_, MSG_DONTWAIT);
  if (got > 0) {
    end_ += static_cast<std::size_t>(got);
    return true;
  }
  return got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
}

std::span<const std::uint8_t> ModbusFrames::next(bool& damaged) {
  damaged = false;
  const std::span<const std::uint8_t> bytes(buffer_.data() + begin_, end_ - begin_);
  if (bytes.size() < header_bytes) return {};
  const std::size_t following = static_cast<std::size_t>(bytes[4]) << 8 | bytes[5];
  const std::size_t size = 6 + following;
  if (bytes[2] != 0 || bytes[3] != 0 || size < header_bytes + 1 || size > max_frame_bytes) {
    damaged = true;
    return {};
  }
  if (bytes.size() < size) return {};
  begin_ += size;
  return bytes.first(size);
}

void ModbusFrames::clear() { begin_ = end_ = 0; }

}  // namespace berth
