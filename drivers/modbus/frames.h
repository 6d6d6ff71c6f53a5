// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/bus/wire.h"

namespace berth {

/// A Modbus TCP frame (Modbus Messaging on TCP/IP, section 3): header of transaction, protocol,
/// length and unit; then function and data. libmodbus writes to descriptors and waits for the rest
/// of what it reads; this knows neither.
class ModbusFrame {
 public:
  static constexpr std::size_t header_bytes = 7;
  static constexpr std::size_t function_at = header_bytes;
  static constexpr std::size_t data_at = function_at + 1;
  static constexpr std::size_t most_bytes = 260;

  ModbusFrame(int unit, int function) {
    bytes_[6] = static_cast<std::uint8_t>(unit);
    put_byte(function);
  }
  void put_byte(int value) { bytes_[size_++] = static_cast<std::uint8_t>(value & 0xff); }
  void put_word(int value) {
    put_byte(value >> 8);
    put_byte(value);
  }
  void put(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) put_byte(byte);
  }
  void set_transaction(int transaction);
  /// The whole frame, its length filled in.
  std::span<const std::uint8_t> bytes();

 private:
  std::array<std::uint8_t, most_bytes> bytes_{};
  std::size_t size_ = header_bytes;
};

/// Cuts the bytes of one connection into Modbus TCP frames. Nothing waits here, so that a slow peer
/// cannot hold the loop.
class ModbusFrames {
 public:
  /// Takes what has come. @return false when the peer is gone.
  bool fill(Wire& wire);
  /// The next whole frame, valid until the next call of fill; empty when there is none yet.
  /// damaged is set when the bytes are not Modbus TCP: close the connection.
  std::span<const std::uint8_t> next(bool& damaged);
  void clear();

 private:
  std::array<std::uint8_t, 4 * ModbusFrame::most_bytes> buffer_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
};

}  // namespace berth
