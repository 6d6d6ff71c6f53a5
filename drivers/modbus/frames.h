// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace berth {

/// Cuts the bytes of one connection into Modbus TCP frames. libmodbus waits inside its receive
/// calls for the rest of a frame; here nothing waits, so that a slow peer cannot hold the loop.
class ModbusFrames {
 public:
  static constexpr std::size_t header_bytes = 7;  ///< MBAP: transaction, protocol, length, unit
  static constexpr std::size_t max_frame_bytes = 260;

  /// Takes what the (non-blocking) descriptor has. @return false when the peer is gone.
  bool fill(int fd);
  /// The next whole frame, valid until the next call of fill; empty when there is none yet.
  /// damaged is set when the bytes are not Modbus TCP: close the connection.
  std::span<const std::uint8_t> next(bool& damaged);
  void clear();

 private:
  std::array<std::uint8_t, 4 * max_frame_bytes> buffer_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
};

}  // namespace berth
