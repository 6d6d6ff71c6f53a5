// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/requests.h"

#include <modbus/modbus.h>

namespace berth {
namespace {

ModbusFrame answer_to(std::span<const std::uint8_t> frame, int function) {
  ModbusFrame answer(frame[6], function);
  answer.set_transaction(frame[0] << 8 | frame[1]);
  return answer;
}

void put_bits(const ModbusAccess& access, const ModbusImage& image, ModbusFrame& answer) {
  answer.put_byte((access.count + 7) / 8);
  for (int begin = 0; begin < access.count; begin += 8) {
    int byte = 0;
    for (int bit = 0; bit < 8 && begin + bit < access.count; ++bit) {
      const int n = access.first + begin + bit;
      const bool on = access.table == ModbusTable::coils ? image.coil(n) : image.input(n);
      if (on) byte |= 1 << bit;
    }
    answer.put_byte(byte);
  }
}

void put_registers(const ModbusAccess& access, ModbusImage& image, ModbusFrame& answer) {
  answer.put_byte(2 * access.count);
  for (const Word word : image.holding(access.first, access.count)) answer.put_word(word);
}

}  // namespace

ModbusAccess inspect(std::span<const std::uint8_t> frame, const ModbusImage& image) {
  const auto pdu = frame.subspan(ModbusFrame::header_bytes);
  const auto number = [&](std::size_t at) { return pdu[at] << 8 | pdu[at + 1]; };
  ModbusAccess access;
  const auto refused = [&](int exception) {
    access.exception = exception;
    return access;
  };
  if (pdu.size() < 5) return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  access.first = number(1) + 1;
  access.count = 1;
  int most = 1;
  std::size_t bytes = 5;
  switch (pdu[0]) {
    case MODBUS_FC_READ_COILS:
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      access.table = pdu[0] == MODBUS_FC_READ_COILS ? ModbusTable::coils : ModbusTable::inputs;
      access.count = number(3);
      most = MODBUS_MAX_READ_BITS;
      break;
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      access.count = number(3);
      most = MODBUS_MAX_READ_REGISTERS;
      break;
    case MODBUS_FC_WRITE_SINGLE_COIL:
      access.write = true;
      access.table = ModbusTable::coils;
      if (number(3) != 0 && number(3) != 0xff00) {
        return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
      }
      break;
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
      access.write = true;
      break;
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS: {
      const bool coils = pdu[0] == MODBUS_FC_WRITE_MULTIPLE_COILS;
      access.write = true;
      access.table = coils ? ModbusTable::coils : ModbusTable::registers;
      access.count = number(3);
      most = coils ? MODBUS_MAX_WRITE_BITS : MODBUS_MAX_WRITE_REGISTERS;
      const int data = coils ? (access.count + 7) / 8 : 2 * access.count;
      bytes = 6 + static_cast<std::size_t>(data);
      if (pdu.size() < 6 || pdu[5] != data) return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
      break;
    }
    default:
      return refused(MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
  }
  if (access.count < 1 || access.count > most || pdu.size() != bytes) {
    return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  }
  if (access.first + access.count - 1 > image.size(access.table)) {
    return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  }
  return access;
}

ModbusFrame carry_out(std::span<const std::uint8_t> frame, const ModbusAccess& access,
                      ModbusImage& image) {
  const int function = frame[ModbusFrame::function_at];
  ModbusFrame answer = answer_to(frame, function);
  if (!access.write) {
    if (access.table == ModbusTable::registers) {
      put_registers(access, image, answer);
    } else {
      put_bits(access, image, answer);
    }
    return answer;
  }
  const auto data = frame.subspan(ModbusFrame::data_at);
  const auto word = [&](std::size_t at) { return static_cast<Word>(data[at] << 8 | data[at + 1]); };
  switch (function) {
    case MODBUS_FC_WRITE_SINGLE_COIL:
      image.set_coil(access.first, word(2) != 0);
      break;
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
      image.holding(access.first) = word(2);
      break;
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
      for (int i = 0; i < access.count; ++i) {
        const std::uint8_t byte = data[5 + static_cast<std::size_t>(i) / 8];
        image.set_coil(access.first + i, (byte >> (i % 8) & 1) != 0);
      }
      break;
    default:  // several registers
      for (int i = 0; i < access.count; ++i) {
        image.holding(access.first + i) = word(5 + 2 * static_cast<std::size_t>(i));
      }
  }
  answer.put(data.first(4));  // where, and how many or what
  return answer;
}

ModbusFrame refuse(std::span<const std::uint8_t> frame, int exception) {
  ModbusFrame answer = answer_to(frame, frame[ModbusFrame::function_at] | 0x80);
  answer.put_byte(exception);
  return answer;
}

}  // namespace berth
