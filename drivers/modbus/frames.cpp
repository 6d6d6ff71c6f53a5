// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/frames.h"

#include <algorithm>

namespace berth {

void ModbusFrame::set_transaction(int transaction) {
  bytes_[0] = static_cast<std::uint8_t>(transaction >> 8 & 0xff);
  bytes_[1] = static_cast<std::uint8_t>(transaction & 0xff);
}

std::span<const std::uint8_t> ModbusFrame::bytes() {
  const std::size_t following = size_ - 6;
  bytes_[4] = static_cast<std::uint8_t>(following >> 8);
  bytes_[5] = static_cast<std::uint8_t>(following & 0xff);
  return std::span<const std::uint8_t>(bytes_).first(size_);
}

bool ModbusFrames::fill(Wire& wire) {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  const auto got = wire.read(std::span(buffer_).subspan(end_));
  if (got) end_ += *got;
  return got.has_value();
}

std::span<const std::uint8_t> ModbusFrames::next(bool& damaged) {
  damaged = false;
  const std::span<const std::uint8_t> bytes(buffer_.data() + begin_, end_ - begin_);
  if (bytes.size() < ModbusFrame::header_bytes) return {};
  const std::size_t following = static_cast<std::size_t>(bytes[4]) << 8 | bytes[5];
  const std::size_t size = 6 + following;
  if (bytes[2] != 0 || bytes[3] != 0 || size < ModbusFrame::header_bytes + 1 ||
      size > ModbusFrame::most_bytes) {
    damaged = true;
    return {};
  }
  if (bytes.size() < size) return {};
  begin_ += size;
  return bytes.first(size);
}

void ModbusFrames::clear() { begin_ = end_ = 0; }

}  // namespace berth
