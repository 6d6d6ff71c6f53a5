// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>

#include "drivers/modbus/frames.h"
#include "drivers/modbus/modbus_image.h"

namespace berth {

/// What a request touches, or the exception that it earns (MODBUS Application Protocol
/// Specification V1.1b3, section 6): functions 1, 2, 3, 5, 6, 15 and 16.
struct ModbusAccess {
  bool write = false;
  ModbusTable table = ModbusTable::registers;
  int first = 0;  ///< from 1
  int count = 0;
  int exception = 0;
};

/// Of a whole frame, whatever it says.
ModbusAccess inspect(std::span<const std::uint8_t> frame, const ModbusImage& image);
/// Does to the image what the frame asks for. @return the answer. The access is the frame's own and
/// free of an exception.
ModbusFrame carry_out(std::span<const std::uint8_t> frame, const ModbusAccess& access,
                      ModbusImage& image);
/// The answer to a frame that is not carried out.
ModbusFrame refuse(std::span<const std::uint8_t> frame, int exception);

}  // namespace berth
